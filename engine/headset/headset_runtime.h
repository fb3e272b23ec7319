// The OpenXR runtime of this machine and its headset: asked for only when a session is to be seen in one.
//
//   headset::HeadsetRuntime runtime;                       // throws where none answers: go on with a window
//   gpu::Device device({.maker = &runtime});            // on the GPU that the headset hangs on
//   headset::Headset headset(runtime, device, {...});      // engine/headset/headset.h
#pragma once

#include "engine/gpu/device.h"
#include "engine/headset/xr.h"

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::headset {

/// Size of the picture of an eye, in pixels, as the runtime recommends it.
struct EyeSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool operator==(const EyeSize&) const = default;
};

/// Instance and system. Outlives the Headset; the gpu::Device made through it may outlive both.
/// Throws HeadsetError (one line) if no runtime answers, it cannot do Vulkan, or no headset is connected. Silences
/// the loader, which tells of a missing runtime in five lines, unless XR_LOADER_DEBUG is set. Thread: one, the main
/// one.
class HeadsetRuntime final : public gpu::DeviceMaker {
public:
  HeadsetRuntime();
  ~HeadsetRuntime() override;
  HeadsetRuntime(const HeadsetRuntime&) = delete;
  HeadsetRuntime& operator=(const HeadsetRuntime&) = delete;

  XrInstance instance() const { return instance_; }
  XrSystemId system() const { return system_; }
  /// "Monado(XRT) by Collabora et al, 24.0.0", and what it calls the headset.
  const std::string& name() const { return name_; }
  const std::string& headset_name() const { return headset_name_; }
  /// Both eyes in one size, the larger of each. @throws HeadsetError
  EyeSize eye_size() const;

  // As gpu::DeviceMaker; they throw HeadsetError where the runtime refuses.
  VkResult create_instance(const VkInstanceCreateInfo& create, VkInstance& instance) override;
  VkPhysicalDevice physical_device(VkInstance instance) override;
  VkResult create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo& create, VkDevice& device) override;

private:
  void create();
  void find_system();
  template <typename Function>
  Function function(const char* name) const;

  XrInstance instance_ = XR_NULL_HANDLE;
  XrSystemId system_ = XR_NULL_SYSTEM_ID;
  std::string name_;
  std::string headset_name_;
};

}  // namespace stylet::headset
