// What a Vulkan call or device did wrong.
#pragma once

#include <vulkan/vulkan.h>

#include <stdexcept>
#include <string>

namespace stylet::gpu {

/// One line: what failed, where, what to do. Thrown while something is made or submitted.
class GpuError : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// The device is of no use any more: its driver was reset, or it hangs. Destroy everything made from it, then the
/// device itself; another may work.
class DeviceLost : public GpuError {
public:
  /// @param why  "vkQueueSubmit2: VK_ERROR_DEVICE_LOST"
  explicit DeviceLost(const std::string& why)
      : GpuError(why + "; the graphics driver reset, start again"), why_(why) {}
  const std::string& why() const { return why_; }

private:
  std::string why_;
};

/// Name of a result code, "VK_ERROR_DEVICE_LOST".
const char* result_name(VkResult result);

/// Throws GpuError "vkCreateBuffer: VK_ERROR_OUT_OF_DEVICE_MEMORY" unless `result` is VK_SUCCESS;
/// DeviceLost where it says so.
void check(VkResult result, const char* call);

}  // namespace stylet::gpu
