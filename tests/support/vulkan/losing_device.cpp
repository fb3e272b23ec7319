// A Vulkan device that is lost, for a program that knows nothing of it: preloaded (LD_PRELOAD) it stands before the
// loader's functions.
//
//   STYLET_LOSE_DEVICE="40 never"
//
// A word a device, in the order in which they are made; the last one holds for all later ones:
//   N       its N-th submission is refused with VK_ERROR_DEVICE_LOST, and whatever it is asked from then on
//   hang:N  its N-th submission is not done in time, and whoever waits for the device without a limit waits forever
//   absent  it cannot be made
//   never   it works
//
// What was submitted before is done first: as of a device that is lost, nothing is in use afterwards. Thread: one.
#include <dlfcn.h>
#include <vulkan/vulkan.h>

#include <unistd.h>

#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

struct Plan {
  bool absent = false;
  bool hangs = false;
  long fails_at = -1;
};

struct State {
  Plan plan;
  long submissions = 0;
  bool lost() const { return !plan.hangs && plan.fails_at >= 0 && submissions >= plan.fails_at; }
  bool hung() const { return plan.hangs && submissions >= plan.fails_at; }
};

Plan plan_of(std::size_t device) {
  const char* text = std::getenv("STYLET_LOSE_DEVICE");
  std::istringstream words(text != nullptr ? text : "never");
  std::string word, next;
  for (std::size_t i = 0; i <= device && words >> next; ++i) word = next;
  if (word == "absent") return {.absent = true};
  if (word.rfind("hang:", 0) == 0) return {.hangs = true, .fails_at = std::stol(word.substr(5))};
  if (word.empty() || word == "never") return {};
  return {.fails_at = std::stol(word)};
}

std::size_t devices_made = 0;
std::map<VkDevice, State> devices;
std::map<VkQueue, VkDevice> owners;

template <typename Function>
Function real(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

#define REAL(function) real(&function, #function)

namespace {

/// Queue by queue: the validation layer cannot wait for a device with an image that was acquired and not used.
VkResult finish(VkDevice device) {
  for (const auto& [queue, owner] : owners)
    if (owner == device) REAL(vkQueueWaitIdle)(queue);
  return VK_ERROR_DEVICE_LOST;
}

}  // namespace

#define EXPORTED extern "C" __attribute__((visibility("default"))) VKAPI_ATTR

EXPORTED VkResult VKAPI_CALL vkCreateDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo* create,
                                            const VkAllocationCallbacks* allocator, VkDevice* device) {
  const Plan plan = plan_of(devices_made++);
  if (plan.absent) return VK_ERROR_INITIALIZATION_FAILED;
  const VkResult result = REAL(vkCreateDevice)(physical, create, allocator, device);
  if (result == VK_SUCCESS) devices[*device] = {plan};
  return result;
}

// The runtime of a headset finds the function by its name.
EXPORTED PFN_vkVoidFunction VKAPI_CALL vkGetInstanceProcAddr(VkInstance instance, const char* name) {
  if (name == std::string("vkCreateDevice")) return reinterpret_cast<PFN_vkVoidFunction>(&vkCreateDevice);
  return REAL(vkGetInstanceProcAddr)(instance, name);
}

EXPORTED void VKAPI_CALL vkDestroyDevice(VkDevice device, const VkAllocationCallbacks* allocator) {
  devices.erase(device);
  std::erase_if(owners, [&](const auto& queue) { return queue.second == device; });
  REAL(vkDestroyDevice)(device, allocator);
}

EXPORTED void VKAPI_CALL vkGetDeviceQueue(VkDevice device, std::uint32_t family, std::uint32_t index,
                                          VkQueue* queue) {
  REAL(vkGetDeviceQueue)(device, family, index, queue);
  owners[*queue] = device;
}

EXPORTED VkResult VKAPI_CALL vkQueueSubmit2(VkQueue queue, std::uint32_t count, const VkSubmitInfo2* submits,
                                            VkFence fence) {
  State& state = devices[owners[queue]];
  ++state.submissions;
  if (state.lost()) return VK_ERROR_DEVICE_LOST;
  return REAL(vkQueueSubmit2)(queue, count, submits, fence);
}

EXPORTED VkResult VKAPI_CALL vkQueueSubmit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* submits,
                                           VkFence fence) {
  if (devices[owners[queue]].lost()) return VK_ERROR_DEVICE_LOST;
  return REAL(vkQueueSubmit)(queue, count, submits, fence);
}

EXPORTED VkResult VKAPI_CALL vkQueuePresentKHR(VkQueue queue, const VkPresentInfoKHR* present) {
  if (devices[owners[queue]].lost()) return VK_ERROR_DEVICE_LOST;
  return REAL(vkQueuePresentKHR)(queue, present);
}

EXPORTED VkResult VKAPI_CALL vkAcquireNextImageKHR(VkDevice device, VkSwapchainKHR swapchain, std::uint64_t timeout,
                                                   VkSemaphore semaphore, VkFence fence, std::uint32_t* index) {
  if (devices[device].lost()) return VK_ERROR_DEVICE_LOST;
  return REAL(vkAcquireNextImageKHR)(device, swapchain, timeout, semaphore, fence, index);
}

EXPORTED VkResult VKAPI_CALL vkWaitSemaphores(VkDevice device, const VkSemaphoreWaitInfo* wait,
                                              std::uint64_t timeout) {
  if (devices[device].lost()) return finish(device);
  const VkResult result = REAL(vkWaitSemaphores)(device, wait, timeout);
  return devices[device].hung() ? VK_TIMEOUT : result;
}

EXPORTED VkResult VKAPI_CALL vkDeviceWaitIdle(VkDevice device) {
  while (devices[device].hung()) pause();
  return devices[device].lost() ? finish(device) : REAL(vkDeviceWaitIdle)(device);
}
