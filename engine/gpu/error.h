// What a Vulkan call or device did wrong.
#pragma once

#include <vulkan/vulkan.h>

#include <stdexcept>
#include <string>

namespace stylet::gpu {

/// One line: what failed, where, what to do. Thrown while something is made or submitted; a lost device is one.
class GpuError : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Name of a result code, "VK_ERROR_DEVICE_LOST".
const char* result_name(VkResult result);

/// Throws GpuError "vkCreateBuffer: VK_ERROR_OUT_OF_DEVICE_MEMORY" unless `result` is VK_SUCCESS.
void check(VkResult result, const char* call);

}  // namespace stylet::gpu
