// Instance, system, paths and events.
#include "tests/support/openxr/state.h"

#include <cstring>

namespace stylet::mock_xr {

namespace {

constexpr XrSystemId kSystem = 1;

XrResult xrEnumerateInstanceExtensionProperties(const char*, std::uint32_t capacity, std::uint32_t* count,
                                                XrExtensionProperties* list) {
  XrExtensionProperties vulkan{XR_TYPE_EXTENSION_PROPERTIES};
  std::strcpy(vulkan.extensionName, XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME);
  vulkan.extensionVersion = XR_KHR_vulkan_enable2_SPEC_VERSION;
  return give(__func__, std::vector{vulkan}, capacity, count, list);
}

XrResult xrCreateInstance(const XrInstanceCreateInfo* create, XrInstance* instance) {
  MOCK_STRUCT(create, XR_TYPE_INSTANCE_CREATE_INFO);
  MOCK_REQUIRE(runtime().only<Instance>() == nullptr, XR_ERROR_LIMIT_REACHED, "one instance at a time");
  MOCK_REQUIRE(create->applicationInfo.applicationName[0] != '\0', XR_ERROR_NAME_INVALID, "no application name");
  MOCK_REQUIRE(XR_VERSION_MAJOR(create->applicationInfo.apiVersion) == 1, XR_ERROR_API_VERSION_UNSUPPORTED,
               "not version 1");
  auto made = std::make_unique<Instance>();
  for (std::uint32_t i = 0; i < create->enabledExtensionCount; ++i) {
    const bool known = std::strcmp(create->enabledExtensionNames[i], XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME) == 0;
    MOCK_REQUIRE(known, XR_ERROR_EXTENSION_NOT_PRESENT, create->enabledExtensionNames[i]);
    made->vulkan = true;
  }
  *instance = handle_of<XrInstance>(runtime().add(std::move(made), nullptr));
  return XR_SUCCESS;
}

XrResult xrDestroyInstance(XrInstance instance) {
  Instance* const found = runtime().find<Instance>(instance);
  MOCK_REQUIRE(found != nullptr, XR_ERROR_HANDLE_INVALID, "no such instance");
  for (const auto& [id, object] : runtime().objects)
    if (object.get() != found) runtime().report.leaks.emplace_back(object->kind());
  runtime().destroy(found);
  runtime().events.clear();
  return XR_SUCCESS;
}

XrResult xrGetInstanceProperties(XrInstance instance, XrInstanceProperties* properties) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(properties, XR_TYPE_INSTANCE_PROPERTIES);
  properties->runtimeVersion = XR_MAKE_VERSION(0, 1, 0);
  std::strcpy(properties->runtimeName, "Stylet's mock runtime");
  return XR_SUCCESS;
}

XrResult xrPollEvent(XrInstance instance, XrEventDataBuffer* event) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(event, XR_TYPE_EVENT_DATA_BUFFER);
  if (runtime().events.empty()) return XR_EVENT_UNAVAILABLE;
  *event = runtime().events.front();
  runtime().events.pop_front();
  return XR_SUCCESS;
}

XrResult xrGetSystem(XrInstance instance, const XrSystemGetInfo* get, XrSystemId* system) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_STRUCT(get, XR_TYPE_SYSTEM_GET_INFO);
  MOCK_REQUIRE(get->formFactor == XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY, XR_ERROR_FORM_FACTOR_UNSUPPORTED,
               "no handheld display");
  MOCK_REQUIRE(runtime().script.connected, XR_ERROR_FORM_FACTOR_UNAVAILABLE, "no headset is connected");
  *system = kSystem;
  return XR_SUCCESS;
}

XrResult xrGetSystemProperties(XrInstance instance, XrSystemId system, XrSystemProperties* properties) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_REQUIRE(system == kSystem, XR_ERROR_SYSTEM_INVALID, "no such system");
  MOCK_STRUCT(properties, XR_TYPE_SYSTEM_PROPERTIES);
  properties->systemId = kSystem;
  properties->vendorId = 0;
  std::strcpy(properties->systemName, "scripted headset");
  properties->graphicsProperties = {4096, 4096, XR_MIN_COMPOSITION_LAYERS_SUPPORTED};
  properties->trackingProperties = {XR_TRUE, XR_TRUE};
  return XR_SUCCESS;
}

XrResult xrEnumerateEnvironmentBlendModes(XrInstance instance, XrSystemId system, XrViewConfigurationType,
                                          std::uint32_t capacity, std::uint32_t* count,
                                          XrEnvironmentBlendMode* list) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_REQUIRE(system == kSystem, XR_ERROR_SYSTEM_INVALID, "no such system");
  return give(__func__, std::vector{XR_ENVIRONMENT_BLEND_MODE_OPAQUE}, capacity, count, list);
}

XrResult xrEnumerateViewConfigurations(XrInstance instance, XrSystemId system, std::uint32_t capacity,
                                       std::uint32_t* count, XrViewConfigurationType* list) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_REQUIRE(system == kSystem, XR_ERROR_SYSTEM_INVALID, "no such system");
  return give(__func__, std::vector{XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO}, capacity, count, list);
}

XrResult xrEnumerateViewConfigurationViews(XrInstance instance, XrSystemId system, XrViewConfigurationType type,
                                           std::uint32_t capacity, std::uint32_t* count,
                                           XrViewConfigurationView* views) {
  MOCK_OBJECT(Instance, found, instance);
  MOCK_REQUIRE(system == kSystem, XR_ERROR_SYSTEM_INVALID, "no such system");
  MOCK_REQUIRE(type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO, XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED,
               "stereo only");
  for (std::uint32_t i = 0; i < capacity; ++i) MOCK_STRUCT(&views[i], XR_TYPE_VIEW_CONFIGURATION_VIEW);
  const Script& script = runtime().script;
  const XrViewConfigurationView view{
      XR_TYPE_VIEW_CONFIGURATION_VIEW, nullptr, script.width, 4096, script.height, 4096, 1, 4};
  return give(__func__, std::vector{view, view}, capacity, count, views);
}

XrResult xrStringToPath(XrInstance instance, const char* text, XrPath* path) {
  MOCK_OBJECT(Instance, found, instance);
  const std::string wanted = text;
  MOCK_REQUIRE(wanted.size() > 1 && wanted.size() < XR_MAX_PATH_LENGTH && wanted.front() == '/' &&
                   wanted.back() != '/' && wanted.find("//") == std::string::npos &&
                   wanted.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_./") == std::string::npos,
               XR_ERROR_PATH_FORMAT_INVALID, wanted);
  for (std::size_t i = 0; i < found->paths.size(); ++i) {
    if (found->paths[i] == wanted) {
      *path = i + 1;
      return XR_SUCCESS;
    }
  }
  found->paths.push_back(wanted);
  *path = found->paths.size();
  return XR_SUCCESS;
}

}  // namespace

const std::string* path_text(const Instance& instance, XrPath path) {
  return path == XR_NULL_PATH || path > instance.paths.size() ? nullptr : &instance.paths[path - 1];
}

PFN_xrVoidFunction instance_function(const char* name) {
  MOCK_ENTRY(xrEnumerateInstanceExtensionProperties);
  MOCK_ENTRY(xrCreateInstance);
  MOCK_ENTRY(xrDestroyInstance);
  MOCK_ENTRY(xrGetInstanceProperties);
  MOCK_ENTRY(xrPollEvent);
  MOCK_ENTRY(xrGetSystem);
  MOCK_ENTRY(xrGetSystemProperties);
  MOCK_ENTRY(xrEnumerateEnvironmentBlendModes);
  MOCK_ENTRY(xrEnumerateViewConfigurations);
  MOCK_ENTRY(xrEnumerateViewConfigurationViews);
  MOCK_ENTRY(xrStringToPath);
  return nullptr;
}

}  // namespace stylet::mock_xr
