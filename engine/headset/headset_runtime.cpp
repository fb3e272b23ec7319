#define XR_USE_GRAPHICS_API_VULKAN
#include "engine/headset/headset_runtime.h"

#include <fmt/format.h>
#include <openxr/openxr_platform.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace stylet::headset {

namespace {

constexpr const char* kNoRuntime =
    "no OpenXR runtime answers ({}); start the headset's own (SteamVR, Monado) and make it the active one";

std::vector<XrExtensionProperties> runtime_extensions() {
  std::uint32_t count = 0;
  XrResult result = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
  std::vector<XrExtensionProperties> list(count, {XR_TYPE_EXTENSION_PROPERTIES});
  if (XR_SUCCEEDED(result)) {
    result = xrEnumerateInstanceExtensionProperties(nullptr, count, &count, list.data());
  }
  if (XR_FAILED(result)) throw HeadsetError(fmt::format(kNoRuntime, xr::result_name(result)), result);
  return list;
}

std::string version_text(XrVersion version) {
  return fmt::format("{}.{}.{}", XR_VERSION_MAJOR(version), XR_VERSION_MINOR(version), XR_VERSION_PATCH(version));
}

}  // namespace

HeadsetRuntime::HeadsetRuntime() {
  setenv("XR_LOADER_DEBUG", "none", 0);
  try {
    create();
    find_system();
  } catch (...) {
    if (instance_ != XR_NULL_HANDLE) xrDestroyInstance(instance_);
    throw;
  }
}

HeadsetRuntime::~HeadsetRuntime() {
  xrDestroyInstance(instance_);
}

void HeadsetRuntime::create() {
  const char* const vulkan = XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME;
  const std::vector<XrExtensionProperties> extensions = runtime_extensions();
  if (std::none_of(extensions.begin(), extensions.end(), [&](const XrExtensionProperties& extension) {
        return std::strcmp(extension.extensionName, vulkan) == 0;
      })) {
    throw HeadsetError(fmt::format("the OpenXR runtime lacks {}; update it or choose another", vulkan));
  }
  XrInstanceCreateInfo create{XR_TYPE_INSTANCE_CREATE_INFO};
  xr::put_text(create.applicationInfo.applicationName, "Stylet");
  create.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  create.enabledExtensionCount = 1;
  create.enabledExtensionNames = &vulkan;
  const XrResult result = xrCreateInstance(&create, &instance_);
  if (XR_FAILED(result)) throw HeadsetError(fmt::format(kNoRuntime, xr::result_name(result)), result);
  XrInstanceProperties properties{XR_TYPE_INSTANCE_PROPERTIES};
  xr::check(xrGetInstanceProperties(instance_, &properties), "xrGetInstanceProperties");
  name_ = fmt::format("{} {}", properties.runtimeName, version_text(properties.runtimeVersion));
}

void HeadsetRuntime::find_system() {
  XrSystemGetInfo get{XR_TYPE_SYSTEM_GET_INFO};
  get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  const XrResult result = xrGetSystem(instance_, &get, &system_);
  if (result == XR_ERROR_FORM_FACTOR_UNAVAILABLE || result == XR_ERROR_FORM_FACTOR_UNSUPPORTED)
    throw HeadsetError(fmt::format("{} sees no headset; connect it and switch it on", name_), result);
  xr::check(result, "xrGetSystem");
  XrSystemProperties properties{XR_TYPE_SYSTEM_PROPERTIES};
  xr::check(xrGetSystemProperties(instance_, system_, &properties), "xrGetSystemProperties");
  headset_name_ = properties.systemName;

  // Must be asked before a device is made.
  XrGraphicsRequirementsVulkan2KHR needs{XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR};
  xr::check(function<PFN_xrGetVulkanGraphicsRequirements2KHR>("xrGetVulkanGraphicsRequirements2KHR")(instance_,
                                                                                                     system_, &needs),
            "xrGetVulkanGraphicsRequirements2KHR");
  if (needs.minApiVersionSupported > XR_MAKE_VERSION(1, 3, 0))
    throw HeadsetError(fmt::format("{} wants Vulkan {}, Stylet uses 1.3; update Stylet", name_,
                                   version_text(needs.minApiVersionSupported)));
}

EyeSize HeadsetRuntime::eye_size() const {
  std::array<XrViewConfigurationView, 2> views{};
  for (XrViewConfigurationView& view : views) view.type = XR_TYPE_VIEW_CONFIGURATION_VIEW;
  std::uint32_t count = 0;
  xr::check(xrEnumerateViewConfigurationViews(instance_, system_, XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO, 2,
                                              &count, views.data()),
            "xrEnumerateViewConfigurationViews");
  EyeSize size;
  for (const XrViewConfigurationView& view : views) {
    size.width = std::max(size.width, std::min(view.recommendedImageRectWidth, view.maxImageRectWidth));
    size.height = std::max(size.height, std::min(view.recommendedImageRectHeight, view.maxImageRectHeight));
  }
  return size;
}

template <typename Function>
Function HeadsetRuntime::function(const char* name) const {
  PFN_xrVoidFunction found = nullptr;
  xr::check(xrGetInstanceProcAddr(instance_, name, &found), name);
  return reinterpret_cast<Function>(found);
}

VkResult HeadsetRuntime::create_instance(const VkInstanceCreateInfo& create, VkInstance& instance) {
  XrVulkanInstanceCreateInfoKHR info{XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR};
  info.systemId = system_;
  info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
  info.vulkanCreateInfo = &create;
  VkResult result = VK_SUCCESS;
  xr::check(
      function<PFN_xrCreateVulkanInstanceKHR>("xrCreateVulkanInstanceKHR")(instance_, &info, &instance, &result),
      "xrCreateVulkanInstanceKHR");
  return result;
}

VkPhysicalDevice HeadsetRuntime::physical_device(VkInstance instance) {
  XrVulkanGraphicsDeviceGetInfoKHR info{XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR};
  info.systemId = system_;
  info.vulkanInstance = instance;
  VkPhysicalDevice device = VK_NULL_HANDLE;
  xr::check(function<PFN_xrGetVulkanGraphicsDevice2KHR>("xrGetVulkanGraphicsDevice2KHR")(instance_, &info, &device),
            "xrGetVulkanGraphicsDevice2KHR");
  return device;
}

VkResult HeadsetRuntime::create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo& create,
                                       VkDevice& device) {
  XrVulkanDeviceCreateInfoKHR info{XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR};
  info.systemId = system_;
  info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
  info.vulkanPhysicalDevice = physical;
  info.vulkanCreateInfo = &create;
  VkResult result = VK_SUCCESS;
  xr::check(function<PFN_xrCreateVulkanDeviceKHR>("xrCreateVulkanDeviceKHR")(instance_, &info, &device, &result),
            "xrCreateVulkanDeviceKHR");
  return result;
}

}  // namespace stylet::headset
