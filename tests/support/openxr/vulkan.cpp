// XR_KHR_vulkan_enable2: instance and device made for the application, with what the runtime adds to both.
#include "tests/support/openxr/state.h"

#include <cstring>

namespace stylet::mock_xr {

namespace {

XrResult xrGetVulkanGraphicsRequirements2KHR(XrInstance instance, XrSystemId,
                                             XrGraphicsRequirementsVulkanKHR* needs) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(needs, XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR);
  found->requirements_asked = true;
  needs->minApiVersionSupported = XR_MAKE_VERSION(1, 0, 0);
  needs->maxApiVersionSupported = XR_MAKE_VERSION(1, 3, 0);
  return XR_SUCCESS;
}

bool has_extension(VkPhysicalDevice physical, const char* name) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> list(count);
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, list.data());
  for (const VkExtensionProperties& extension : list)
    if (std::strcmp(extension.extensionName, name) == 0) return true;
  return false;
}

/// The application's list and one more.
std::vector<const char*> with(const char* const* list, std::uint32_t count, const char* more) {
  std::vector<const char*> all(list, list + count);
  for (const char* name : all)
    if (std::strcmp(name, more) == 0) return all;
  all.push_back(more);
  return all;
}

XrResult xrCreateVulkanInstanceKHR(XrInstance instance, const XrVulkanInstanceCreateInfoKHR* create, VkInstance* made,
                                   VkResult* result) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(create, XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR);
  MOCK_REQUIRE(found->requirements_asked, XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING, "ask for them first");
  const auto vk_create =
      reinterpret_cast<PFN_vkCreateInstance>(create->pfnGetInstanceProcAddr(VK_NULL_HANDLE, "vkCreateInstance"));
  VkInstanceCreateInfo info = *create->vulkanCreateInfo;
  const auto extensions = with(info.ppEnabledExtensionNames, info.enabledExtensionCount,
                               VK_KHR_EXTERNAL_MEMORY_CAPABILITIES_EXTENSION_NAME);
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  *result = vk_create(&info, create->vulkanAllocator, made);
  if (*result == VK_SUCCESS) found->vk_instance = *made;
  return XR_SUCCESS;
}

XrResult xrGetVulkanGraphicsDevice2KHR(XrInstance instance, const XrVulkanGraphicsDeviceGetInfoKHR* get,
                                       VkPhysicalDevice* device) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(get, XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR);
  MOCK_REQUIRE(get->vulkanInstance == found->vk_instance, XR_ERROR_VALIDATION_FAILURE, "not the instance made here");
  std::uint32_t one = 1;
  vkEnumeratePhysicalDevices(get->vulkanInstance, &one, device);
  MOCK_REQUIRE(one == 1, XR_ERROR_RUNTIME_FAILURE, "no GPU");
  found->vk_physical = *device;
  return XR_SUCCESS;
}

XrResult xrCreateVulkanDeviceKHR(XrInstance instance, const XrVulkanDeviceCreateInfoKHR* create, VkDevice* made,
                                 VkResult* result) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(create, XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR);
  MOCK_REQUIRE(create->vulkanPhysicalDevice == found->vk_physical && found->vk_physical != VK_NULL_HANDLE,
               XR_ERROR_VALIDATION_FAILURE, "not the GPU that the runtime named");
  VkDeviceCreateInfo info = *create->vulkanCreateInfo;
  std::vector<const char*> extensions(info.ppEnabledExtensionNames,
                                      info.ppEnabledExtensionNames + info.enabledExtensionCount);
  if (has_extension(found->vk_physical, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME))
    extensions =
        with(info.ppEnabledExtensionNames, info.enabledExtensionCount, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME);
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  // As Monado does: a feature struct of its own in front of the application's. Where that has VkPhysicalDevice-
  // Vulkan12Features the two may not be together, and validation says so.
  VkPhysicalDeviceTimelineSemaphoreFeatures timeline{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES};
  timeline.timelineSemaphore = VK_TRUE;
  bool there = false;
  for (const auto* next = static_cast<const VkBaseInStructure*>(info.pNext); next != nullptr; next = next->pNext)
    there = there || next->sType == timeline.sType;
  if (!there) {
    timeline.pNext = const_cast<void*>(info.pNext);
    info.pNext = &timeline;
  }
  const auto vk_create =
      reinterpret_cast<PFN_vkCreateDevice>(create->pfnGetInstanceProcAddr(found->vk_instance, "vkCreateDevice"));
  *result = vk_create(create->vulkanPhysicalDevice, &info, create->vulkanAllocator, made);
  if (*result == VK_SUCCESS) found->vk_device = *made;
  return XR_SUCCESS;
}

}  // namespace

PFN_xrVoidFunction vulkan_function(const char* name) {
  MOCK_ENTRY(xrGetVulkanGraphicsRequirements2KHR);
  MOCK_ENTRY(xrCreateVulkanInstanceKHR);
  MOCK_ENTRY(xrGetVulkanGraphicsDevice2KHR);
  MOCK_ENTRY(xrCreateVulkanDeviceKHR);
  return nullptr;
}

}  // namespace stylet::mock_xr
