// The Vulkan device: instance, choice of GPU, the one queue, validation.
#pragma once

#include "engine/gpu/error.h"
#include "engine/gpu/handle.h"

#include <vulkan/vulkan.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace stylet::gpu {

/// Who makes the Vulkan instance and device in place of Vulkan itself, and says which GPU: the runtime of a headset,
/// which adds to both what it needs to show images.
class DeviceMaker {
public:
  virtual ~DeviceMaker() = default;
  virtual VkResult create_instance(const VkInstanceCreateInfo& create, VkInstance& instance) = 0;
  /// The GPU to draw on; null: none.
  virtual VkPhysicalDevice physical_device(VkInstance instance) = 0;
  virtual VkResult create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo& create, VkDevice& device) = 0;
};

struct DeviceSettings {
  /// Which GPU: a part of its name (case ignored), its index in the list, or empty: discrete before integrated before
  /// CPU.
  std::string gpu;
  /// Core and synchronisation validation; also switched on by STYLET_VALIDATION=1 in the environment.
  bool validation = false;
  /// Counts validation messages (warnings and errors) here too, so that a test also sees those made while the device
  /// is destroyed. Must outlive the device.
  std::atomic<std::uint32_t>* message_counter = nullptr;
  /// Extensions a window system asks for (engine/view/window.h); with any, VK_KHR_swapchain is enabled on the device.
  std::vector<std::string> window_extensions{};
  /// Null: Vulkan. It chooses the GPU, and a name in `gpu` that is not its own is an error. Used by the constructor
  /// only.
  DeviceMaker* maker = nullptr;
};

/// What the device calls itself.
struct DeviceIdentity {
  std::string name;         ///< "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string driver;       ///< "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  std::string api_version;  ///< "1.3.230"
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  VkDriverId driver_id = VK_DRIVER_ID_MAX_ENUM;

  /// Mesa's software rasteriser, whose output is the same bits everywhere: golden images hold for it alone.
  bool is_lavapipe() const { return type == VK_PHYSICAL_DEVICE_TYPE_CPU && driver_id == VK_DRIVER_ID_MESA_LLVMPIPE; }
};

/// A Vulkan 1.3 device with one queue that draws, computes and copies. Outlives everything made from it.
/// Throws GpuError if there is no Vulkan, no such GPU, or the GPU lacks a feature; the message lists the GPUs there
/// are. Thread: everything in engine/gpu is used by one thread at a time.
class Device {
public:
  explicit Device(const DeviceSettings& settings = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  VkInstance instance() const { return instance_; }
  VkPhysicalDevice physical() const { return physical_; }
  VkDevice handle() const { return device_; }
  VkQueue queue() const { return queue_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const DeviceIdentity& identity() const { return identity_; }
  const VkPhysicalDeviceLimits& limits() const { return limits_; }
  bool can_present() const { return can_present_; }

  bool validation() const { return messenger_ != VK_NULL_HANDLE; }
  /// Validation warnings and errors so far; each was printed to stderr when it came.
  std::uint32_t validation_messages() const { return messages_->load(); }

  /// Submits a recorded command buffer; returns its place on the device's timeline.
  std::uint64_t submit(VkCommandBuffer commands, const std::vector<VkSemaphoreSubmitInfo>& waits = {},
                       const std::vector<VkSemaphoreSubmitInfo>& signals = {});
  /// Returns when the submission `value` is done. Throws DeviceLost, also if it is not within two minutes: the device
  /// hangs.
  void wait(std::uint64_t value) const;
  void wait_idle() const { wait(submitted_); }
  /// For destructors: returns when nothing made from the device is in use any more, by the window system neither. Of
  /// a lost device nothing is in use; nor is a hung one waited for.
  void settle() const noexcept;

  /// Memory for `requirements` of a type with all `required` flags, preferring those that also have `preferred`.
  MemoryHandle allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags required,
                        VkMemoryPropertyFlags preferred, bool device_address = false);

  PFN_vkCmdPushDescriptorSetKHR push_descriptors = nullptr;

private:
  void create_instance(const DeviceSettings& settings);
  void choose_physical(const DeviceSettings& settings);
  void create_device(DeviceMaker* maker);
  void destroy();

  std::atomic<std::uint32_t> own_counter_{0};
  std::atomic<std::uint32_t>* messages_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  bool can_present_ = false;
  DeviceIdentity identity_;
  VkPhysicalDeviceLimits limits_{};
  VkPhysicalDeviceMemoryProperties memory_{};
  VkSemaphore timeline_ = VK_NULL_HANDLE;
  std::uint64_t submitted_ = 0;
  mutable bool hung_ = false;
};

/// Names of the Vulkan devices of this machine, in the order of their index; empty if there is no Vulkan.
std::vector<std::string> device_names();

}  // namespace stylet::gpu
