#include "engine/gpu/device.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>

namespace stylet::gpu {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL count_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                             VkDebugUtilsMessageTypeFlagsEXT,
                                             const VkDebugUtilsMessengerCallbackDataEXT* data, void* counter) {
  const bool error = (severity & VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT) != 0;
  static_cast<std::atomic<std::uint32_t>*>(counter)->fetch_add(1);
  std::fprintf(stderr, "Vulkan validation %s: %s\n", error ? "error" : "warning", data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_settings(std::atomic<std::uint32_t>* counter) {
  VkDebugUtilsMessengerCreateInfoEXT create{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
  create.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  create.messageType =
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  create.pfnUserCallback = count_message;
  create.pUserData = counter;
  return create;
}

bool has_validation_layer() {
  std::uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  return std::any_of(layers.begin(), layers.end(), [](const VkLayerProperties& layer) {
    return std::strcmp(layer.layerName, kValidationLayer) == 0;
  });
}

std::vector<VkPhysicalDevice> physical_devices(VkInstance instance) {
  std::uint32_t count = 0;
  vkEnumeratePhysicalDevices(instance, &count, nullptr);
  std::vector<VkPhysicalDevice> devices(count);
  vkEnumeratePhysicalDevices(instance, &count, devices.data());
  return devices;
}

DeviceIdentity identify(VkPhysicalDevice device, VkPhysicalDeviceLimits* limits = nullptr) {
  VkPhysicalDeviceDriverProperties driver{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver};
  vkGetPhysicalDeviceProperties2(device, &properties);
  const auto& core = properties.properties;
  if (limits != nullptr) *limits = core.limits;
  return {core.deviceName, fmt::format("{} {}", driver.driverName, driver.driverInfo),
          fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(core.apiVersion), VK_API_VERSION_MINOR(core.apiVersion),
                      VK_API_VERSION_PATCH(core.apiVersion)),
          core.deviceType, driver.driverID};
}

std::string listing(const std::vector<VkPhysicalDevice>& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i)
    text += fmt::format("{}{} \"{}\"", i == 0 ? "" : ", ", i, identify(devices[i]).name);
  return text;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

int preference(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 1;
    default:
      return 0;
  }
}

/// Features that Stylet cannot do without, as a chain for both asking and enabling. Individual structs and not
/// VkPhysicalDeviceVulkan12Features: VR runtimes append their own to the chain, and the two may not be mixed.
struct Features {
  VkPhysicalDeviceMultiviewFeatures multiview{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MULTIVIEW_FEATURES};
  VkPhysicalDeviceTimelineSemaphoreFeatures timeline{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES,
                                                     &multiview};
  VkPhysicalDeviceSynchronization2Features sync2{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES,
                                                 &timeline};
  VkPhysicalDeviceBufferDeviceAddressFeatures address{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES, &sync2};
  VkPhysicalDeviceScalarBlockLayoutFeatures scalar{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SCALAR_BLOCK_LAYOUT_FEATURES,
                                                   &address};
  VkPhysicalDeviceMaintenance4Features maintenance4{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_FEATURES,
                                                    &scalar};
  VkPhysicalDeviceFeatures2 core{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &maintenance4};

  /// Names of those a device lacks, empty if none.
  std::string missing() const {
    std::string names;
    const auto need = [&](VkBool32 has, const char* name) {
      if (has == VK_FALSE) names += std::string(names.empty() ? "" : ", ") + name;
    };
    need(multiview.multiview, "multiview");
    need(timeline.timelineSemaphore, "timelineSemaphore");
    need(sync2.synchronization2, "synchronization2");
    need(address.bufferDeviceAddress, "bufferDeviceAddress");
    need(scalar.scalarBlockLayout, "scalarBlockLayout");
    need(maintenance4.maintenance4, "maintenance4");
    need(core.features.independentBlend, "independentBlend");
    return names;
  }
  /// Only what missing() names: nothing is enabled because a device happens to have it.
  void enable_required() {
    *this = Features{};
    multiview.multiview = timeline.timelineSemaphore = sync2.synchronization2 = VK_TRUE;
    address.bufferDeviceAddress = scalar.scalarBlockLayout = maintenance4.maintenance4 = VK_TRUE;
    core.features.independentBlend = VK_TRUE;
    link();
  }
  Features() = default;
  Features(const Features&) = delete;
  Features& operator=(const Features&) = default;

private:
  void link() {
    multiview.pNext = nullptr;
    timeline.pNext = &multiview;
    sync2.pNext = &timeline;
    address.pNext = &sync2;
    scalar.pNext = &address;
    maintenance4.pNext = &scalar;
    core.pNext = &maintenance4;
  }
};

}  // namespace

Device::Device(const DeviceSettings& settings)
    : messages_(settings.message_counter != nullptr ? settings.message_counter : &own_counter_),
      can_present_(!settings.window_extensions.empty()) {
  try {
    create_instance(settings);
    choose_physical(settings);
    create_device(settings.maker);
  } catch (...) {
    destroy();
    throw;
  }
}

Device::~Device() {
  destroy();
}

void Device::create_instance(const DeviceSettings& settings) {
  const char* asked = std::getenv("STYLET_VALIDATION");
  const bool validation = settings.validation || (asked != nullptr && std::string_view(asked) == "1");
  std::vector<const char*> extensions;
  std::vector<const char*> layers;
  for (const std::string& extension : settings.window_extensions) extensions.push_back(extension.c_str());

  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.pApplicationName = "Stylet";
  application.apiVersion = VK_API_VERSION_1_3;
  VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  create.pApplicationInfo = &application;
  VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_settings(messages_);
  const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  VkValidationFeaturesEXT features{
      VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT, &messenger, 1, &synchronization, 0, nullptr};
  if (validation) {
    if (!has_validation_layer())
      throw GpuError(
          fmt::format("Vulkan validation was asked for but {} is not installed; install the package "
                      "vulkan-validationlayers",
                      kValidationLayer));
    // Hazards between submissions are only looked for when the environment says so (layer 1.3.239).
    setenv("VK_LAYER_ENABLES", "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT", 0);
    layers.push_back(kValidationLayer);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    create.pNext = &features;
  }
  create.enabledLayerCount = static_cast<std::uint32_t>(layers.size());
  create.ppEnabledLayerNames = layers.data();
  create.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  const VkResult result = settings.maker != nullptr ? settings.maker->create_instance(create, instance_)
                                                    : vkCreateInstance(&create, nullptr, &instance_);
  if (result != VK_SUCCESS)
    throw GpuError(
        fmt::format("vkCreateInstance: {}; install a Vulkan 1.3 driver (mesa-vulkan-drivers has one for "
                    "every machine)",
                    result_name(result)));
  if (validation) {
    const auto make = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    check(make(instance_, &messenger, nullptr, &messenger_), "vkCreateDebugUtilsMessengerEXT");
  }
}

void Device::choose_physical(const DeviceSettings& settings) {
  const std::string& wanted = settings.gpu;
  std::vector<VkPhysicalDevice> devices = physical_devices(instance_);
  if (settings.maker != nullptr) {
    const VkPhysicalDevice chosen = settings.maker->physical_device(instance_);
    std::erase_if(devices, [&](VkPhysicalDevice device) { return device != chosen; });
  }
  if (devices.empty())
    throw GpuError(
        "no Vulkan device found; install a Vulkan 1.3 driver (mesa-vulkan-drivers has one for every machine)");
  const bool is_index = !wanted.empty() && std::all_of(wanted.begin(), wanted.end(),
                                                       [](unsigned char c) { return std::isdigit(c) != 0; });
  if (is_index) {
    // Nine digits always fit; a longer number is no index anyway.
    const std::size_t index = wanted.size() < 10 ? std::stoul(wanted) : devices.size();
    if (index < devices.size()) physical_ = devices[index];
  } else if (!wanted.empty()) {
    for (VkPhysicalDevice device : devices) {
      if (lower(identify(device).name).find(lower(wanted)) == std::string::npos) continue;
      physical_ = device;
      break;
    }
  } else {
    physical_ = *std::max_element(devices.begin(), devices.end(), [](VkPhysicalDevice a, VkPhysicalDevice b) {
      return preference(identify(a).type) < preference(identify(b).type);
    });
  }
  if (physical_ == VK_NULL_HANDLE)
    throw GpuError(fmt::format("no Vulkan device matches \"{}\"; there are: {}", wanted, listing(devices)));
  identity_ = identify(physical_, &limits_);
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
}

void Device::create_device(DeviceMaker* maker) {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical_, &properties);
  if (properties.apiVersion < VK_API_VERSION_1_3)
    throw GpuError(fmt::format("{} has Vulkan {}, 1.3 is needed; update its driver or choose another (--gpu)",
                               identity_.name, identity_.api_version));
  Features features;
  vkGetPhysicalDeviceFeatures2(physical_, &features.core);
  const std::string missing = features.missing();
  if (!missing.empty())
    throw GpuError(fmt::format("{} lacks the Vulkan features {}; update its driver or choose another (--gpu)",
                               identity_.name, missing));
  features.enable_required();

  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, families.data());
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  const auto family = std::find_if(families.begin(), families.end(), [](const VkQueueFamilyProperties& f) {
    return (f.queueFlags & kNeeded) == kNeeded;
  });
  if (family == families.end())
    throw GpuError(
        fmt::format("{} has no queue that both draws and computes; choose another (--gpu)", identity_.name));
  queue_family_ = static_cast<std::uint32_t>(family - families.begin());

  const float priority = 1;
  VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  std::vector<const char*> extensions{VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME};
  if (can_present_) extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
  VkDeviceCreateInfo create{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features.core};
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  create.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  const VkResult result = maker != nullptr ? maker->create_device(physical_, create, device_)
                                           : vkCreateDevice(physical_, &create, nullptr, &device_);
  if (result != VK_SUCCESS)
    throw GpuError(fmt::format("vkCreateDevice on {}: {}; update its driver or choose another (--gpu)",
                               identity_.name, result_name(result)));
  vkGetDeviceQueue(device_, queue_family_, 0, &queue_);
  push_descriptors =
      reinterpret_cast<PFN_vkCmdPushDescriptorSetKHR>(vkGetDeviceProcAddr(device_, "vkCmdPushDescriptorSetKHR"));

  VkSemaphoreTypeCreateInfo type{VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO};
  type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
  VkSemaphoreCreateInfo semaphore{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type};
  check(vkCreateSemaphore(device_, &semaphore, nullptr, &timeline_), "vkCreateSemaphore");
}

void Device::destroy() {
  if (device_ != VK_NULL_HANDLE) {
    settle();
    if (timeline_ != VK_NULL_HANDLE) vkDestroySemaphore(device_, timeline_, nullptr);
    vkDestroyDevice(device_, nullptr);
  }
  if (messenger_ != VK_NULL_HANDLE) {
    const auto remove = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
    remove(instance_, messenger_, nullptr);
  }
  if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
}

std::uint64_t Device::submit(VkCommandBuffer commands, const std::vector<VkSemaphoreSubmitInfo>& waits,
                             const std::vector<VkSemaphoreSubmitInfo>& signals) {
  std::vector<VkSemaphoreSubmitInfo> all_signals = signals;
  VkSemaphoreSubmitInfo done{VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
  done.semaphore = timeline_;
  done.value = submitted_ + 1;
  done.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  all_signals.push_back(done);
  VkCommandBufferSubmitInfo buffer{VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO};
  buffer.commandBuffer = commands;
  VkSubmitInfo2 submit{VK_STRUCTURE_TYPE_SUBMIT_INFO_2};
  submit.waitSemaphoreInfoCount = static_cast<std::uint32_t>(waits.size());
  submit.pWaitSemaphoreInfos = waits.data();
  submit.commandBufferInfoCount = 1;
  submit.pCommandBufferInfos = &buffer;
  submit.signalSemaphoreInfoCount = static_cast<std::uint32_t>(all_signals.size());
  submit.pSignalSemaphoreInfos = all_signals.data();
  check(vkQueueSubmit2(queue_, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit2");
  return ++submitted_;
}

void Device::wait(std::uint64_t value) const {
  if (value == 0) return;
  constexpr std::uint64_t kTimeoutNs = 120'000'000'000;
  VkSemaphoreWaitInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
  info.semaphoreCount = 1;
  info.pSemaphores = &timeline_;
  info.pValues = &value;
  const VkResult result = vkWaitSemaphores(device_, &info, kTimeoutNs);
  if (result == VK_TIMEOUT) {
    hung_ = true;
    throw DeviceLost(fmt::format("{} hangs: a submission took longer than two minutes", identity_.name));
  }
  check(result, "vkWaitSemaphores");
}

void Device::settle() const noexcept {
  if (!hung_) vkDeviceWaitIdle(device_);
}

MemoryHandle Device::allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags required,
                              VkMemoryPropertyFlags preferred, bool device_address) {
  const auto find = [&](VkMemoryPropertyFlags flags) -> std::optional<std::uint32_t> {
    for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
      if ((requirements.memoryTypeBits >> i & 1u) != 0 && (memory_.memoryTypes[i].propertyFlags & flags) == flags)
        return i;
    return std::nullopt;
  };
  auto type = find(required | preferred);
  if (!type) type = find(required);
  if (!type) throw GpuError(fmt::format("{} has no memory type with flags {:#x}", identity_.name, required));
  const VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO, nullptr,
                                        VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT, 0};
  VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  allocate.pNext = device_address ? &flags : nullptr;
  allocate.allocationSize = requirements.size;
  allocate.memoryTypeIndex = *type;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  check(vkAllocateMemory(device_, &allocate, nullptr, &memory), "vkAllocateMemory");
  return {device_, memory};
}

std::vector<std::string> device_names() {
  VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  VkInstance instance = VK_NULL_HANDLE;
  if (vkCreateInstance(&create, nullptr, &instance) != VK_SUCCESS) return {};
  std::vector<std::string> names;
  for (VkPhysicalDevice device : physical_devices(instance)) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(device, &properties);
    names.emplace_back(properties.deviceName);
  }
  vkDestroyInstance(instance, nullptr);
  return names;
}

}  // namespace stylet::gpu
