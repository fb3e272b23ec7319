#include "engine/gpu/error.h"

namespace stylet::gpu {

const char* result_name(VkResult result) {
  switch (result) {
#define STYLET_NAME(code) \
  case code:              \
    return #code
    STYLET_NAME(VK_SUCCESS);
    STYLET_NAME(VK_NOT_READY);
    STYLET_NAME(VK_TIMEOUT);
    STYLET_NAME(VK_INCOMPLETE);
    STYLET_NAME(VK_SUBOPTIMAL_KHR);
    STYLET_NAME(VK_ERROR_OUT_OF_HOST_MEMORY);
    STYLET_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY);
    STYLET_NAME(VK_ERROR_INITIALIZATION_FAILED);
    STYLET_NAME(VK_ERROR_DEVICE_LOST);
    STYLET_NAME(VK_ERROR_LAYER_NOT_PRESENT);
    STYLET_NAME(VK_ERROR_EXTENSION_NOT_PRESENT);
    STYLET_NAME(VK_ERROR_FEATURE_NOT_PRESENT);
    STYLET_NAME(VK_ERROR_INCOMPATIBLE_DRIVER);
    STYLET_NAME(VK_ERROR_FORMAT_NOT_SUPPORTED);
    STYLET_NAME(VK_ERROR_SURFACE_LOST_KHR);
    STYLET_NAME(VK_ERROR_OUT_OF_DATE_KHR);
#undef STYLET_NAME
    default:
      return "unlisted VkResult";
  }
}

void check(VkResult result, const char* call) {
  if (result == VK_SUCCESS) return;
  std::string text = std::string(call) + ": " + result_name(result);
  if (result == VK_ERROR_DEVICE_LOST) throw DeviceLost(text);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY) text += "; choose a smaller size or another GPU (--gpu)";
  throw GpuError(text);
}

}  // namespace stylet::gpu
