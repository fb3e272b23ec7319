// Images on the application's own device, handed out in turn.
#include "tests/support/openxr/state.h"

#include <algorithm>
#include <cstring>

namespace stylet::mock_xr {

namespace {

constexpr std::uint32_t kImages = 3;

std::uint32_t memory_type(VkPhysicalDevice physical, std::uint32_t allowed, VkMemoryPropertyFlags wanted) {
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(physical, &memory);
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
    if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  return 0;
}

VkDeviceMemory allocate(const Session& session, const VkMemoryRequirements& needs, VkMemoryPropertyFlags wanted) {
  VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  info.allocationSize = needs.size;
  info.memoryTypeIndex = memory_type(session.graphics.physicalDevice, needs.memoryTypeBits, wanted);
  VkDeviceMemory memory = VK_NULL_HANDLE;
  vkAllocateMemory(session.graphics.device, &info, nullptr, &memory);
  return memory;
}

/// Runs commands on the application's queue, which is the runtime's while a call of its is in progress, and waits.
template <typename Record>
void run(const Session& session, const Record& record) {
  VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  allocate.commandPool = session.pool;
  allocate.commandBufferCount = 1;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  vkAllocateCommandBuffers(session.graphics.device, &allocate, &commands);
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  vkBeginCommandBuffer(commands, &begin);
  record(commands);
  vkEndCommandBuffer(commands);
  VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  vkQueueSubmit(session.queue, 1, &submit, VK_NULL_HANDLE);
  vkQueueWaitIdle(session.queue);
  vkFreeCommandBuffers(session.graphics.device, session.pool, 1, &commands);
}

void barrier(VkCommandBuffer commands, VkImage image, std::uint32_t layers, VkImageLayout from, VkImageLayout to) {
  VkImageMemoryBarrier change{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
  change.srcAccessMask = from == VK_IMAGE_LAYOUT_UNDEFINED ? 0 : VK_ACCESS_MEMORY_WRITE_BIT;
  change.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  change.oldLayout = from;
  change.newLayout = to;
  change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.image = image;
  change.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, layers};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0,
                       nullptr, 0, nullptr, 1, &change);
}

VkImageUsageFlags vulkan_usage(XrSwapchainUsageFlags usage) {
  VkImageUsageFlags flags = VK_IMAGE_USAGE_TRANSFER_SRC_BIT;  // the runtime's own use
  if ((usage & XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT) != 0) flags |= VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  if ((usage & XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT) != 0) flags |= VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  if ((usage & XR_SWAPCHAIN_USAGE_SAMPLED_BIT) != 0) flags |= VK_IMAGE_USAGE_SAMPLED_BIT;
  return flags;
}

std::vector<std::int64_t> formats() {
  if (runtime().script.bgra_only) return {VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_B8G8R8A8_UNORM};
  return {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_R8G8B8A8_UNORM};
}

XrResult xrEnumerateSwapchainFormats(XrSession session, std::uint32_t capacity, std::uint32_t* count,
                                     std::int64_t* list) {
  MOCK_SESSION(found, session);
  return give(__func__, formats(), capacity, count, list);
}

XrResult xrCreateSwapchain(XrSession session, const XrSwapchainCreateInfo* create, XrSwapchain* swapchain) {
  MOCK_SESSION(found, session);
  MOCK_STRUCT(create, XR_TYPE_SWAPCHAIN_CREATE_INFO);
  const std::vector<std::int64_t> offered = formats();
  MOCK_REQUIRE(std::find(offered.begin(), offered.end(), create->format) != offered.end(),
               XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED, "not offered");
  MOCK_REQUIRE(create->sampleCount == 1 && create->faceCount == 1 && create->mipCount == 1 && create->arraySize > 0 &&
                   create->width > 0 && create->width <= 4096 && create->height > 0 && create->height <= 4096,
               XR_ERROR_VALIDATION_FAILURE, "size");
  MOCK_REQUIRE((create->usageFlags & XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT) != 0, XR_ERROR_VALIDATION_FAILURE,
               "images are handed out as colour attachments");
  const VkDevice device = found->graphics.device;
  auto made = std::make_unique<Swapchain>();
  made->create = *create;
  made->device = device;
  for (std::uint32_t i = 0; i < kImages; ++i) {
    VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = static_cast<VkFormat>(create->format);
    info.extent = {create->width, create->height, 1};
    info.mipLevels = 1;
    info.arrayLayers = create->arraySize;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = vulkan_usage(create->usageFlags);
    VkImage image = VK_NULL_HANDLE;
    MOCK_REQUIRE(vkCreateImage(device, &info, nullptr, &image) == VK_SUCCESS, XR_ERROR_RUNTIME_FAILURE,
                 "vkCreateImage");
    made->images.push_back(image);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, image, &needs);
    made->memory.push_back(allocate(*found, needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT));
    vkBindImageMemory(device, image, made->memory.back(), 0);
  }
  run(*found, [&](VkCommandBuffer commands) {
    for (VkImage image : made->images)
      barrier(commands, image, create->arraySize, VK_IMAGE_LAYOUT_UNDEFINED,
              VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
  });
  ++runtime().report.swapchains;
  *swapchain = handle_of<XrSwapchain>(runtime().add(std::move(made), found));
  return XR_SUCCESS;
}

XrResult xrDestroySwapchain(XrSwapchain swapchain) {
  Swapchain* const found = runtime().find<Swapchain>(swapchain);
  MOCK_REQUIRE(found != nullptr, XR_ERROR_HANDLE_INVALID, "no such swapchain");
  runtime().destroy(found);
  return XR_SUCCESS;
}

XrResult xrEnumerateSwapchainImages(XrSwapchain swapchain, std::uint32_t capacity, std::uint32_t* count,
                                    XrSwapchainImageBaseHeader* list) {
  MOCK_OBJECT(Swapchain, found, swapchain);
  auto* const images = reinterpret_cast<XrSwapchainImageVulkanKHR*>(list);
  for (std::uint32_t i = 0; i < capacity; ++i) MOCK_STRUCT(&images[i], XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR);
  std::vector<XrSwapchainImageVulkanKHR> all;
  for (VkImage image : found->images) all.push_back({XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR, nullptr, image});
  return give(__func__, all, capacity, count, images);
}

XrResult xrAcquireSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageAcquireInfo*, std::uint32_t* index) {
  MOCK_OBJECT(Swapchain, found, swapchain);
  MOCK_REQUIRE(!dynamic_cast<Session&>(*found->parent).lost, XR_ERROR_SESSION_LOST, "the session is lost");
  MOCK_REQUIRE(found->acquired.size() < found->images.size(), XR_ERROR_CALL_ORDER_INVALID, "all are acquired");
  *index = found->next;
  found->acquired.push_back(found->next);
  found->next = (found->next + 1) % static_cast<std::uint32_t>(found->images.size());
  return XR_SUCCESS;
}

XrResult xrWaitSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageWaitInfo* wait) {
  MOCK_OBJECT(Swapchain, found, swapchain);
  MOCK_STRUCT(wait, XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
  MOCK_REQUIRE(!found->acquired.empty() && !found->front_waited, XR_ERROR_CALL_ORDER_INVALID, "nothing to wait for");
  found->front_waited = true;
  return XR_SUCCESS;
}

XrResult xrReleaseSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageReleaseInfo*) {
  MOCK_OBJECT(Swapchain, found, swapchain);
  MOCK_REQUIRE(found->front_waited, XR_ERROR_CALL_ORDER_INVALID, "not waited for");
  found->released = found->acquired.front();
  found->acquired.pop_front();
  found->front_waited = false;
  return XR_SUCCESS;
}

}  // namespace

Swapchain::~Swapchain() {
  for (VkImage image : images) vkDestroyImage(device, image, nullptr);
  for (VkDeviceMemory block : memory) vkFreeMemory(device, block, nullptr);
}

void read_back(Session& session, const Swapchain& swapchain, Submitted& out) {
  const VkDevice device = session.graphics.device;
  const VkImage image = swapchain.images[*swapchain.released];
  const VkDeviceSize eye_bytes = VkDeviceSize{4} * out.width * out.height;
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = 2 * eye_bytes;
  create.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  vkCreateBuffer(device, &create, nullptr, &buffer);
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device, buffer, &needs);
  const VkDeviceMemory memory =
      allocate(session, needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  vkBindBufferMemory(device, buffer, memory, 0);
  run(session, [&](VkCommandBuffer commands) {
    barrier(commands, image, swapchain.create.arraySize, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
            VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 2};
    region.imageExtent = {out.width, out.height, 1};
    vkCmdCopyImageToBuffer(commands, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, buffer, 1, &region);
    barrier(commands, image, swapchain.create.arraySize, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
            VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    VkMemoryBarrier to_host{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    to_host.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    to_host.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0,
                         nullptr, 0, nullptr);
  });
  void* mapped = nullptr;
  vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &mapped);
  for (std::size_t eye = 0; eye < 2; ++eye) {
    out.rgba[eye].resize(eye_bytes);
    std::memcpy(out.rgba[eye].data(), static_cast<const std::uint8_t*>(mapped) + eye * eye_bytes, eye_bytes);
    if (swapchain.create.format == VK_FORMAT_B8G8R8A8_SRGB)
      for (std::size_t i = 0; i < eye_bytes; i += 4) std::swap(out.rgba[eye][i], out.rgba[eye][i + 2]);
  }
  vkUnmapMemory(device, memory);
  vkDestroyBuffer(device, buffer, nullptr);
  vkFreeMemory(device, memory, nullptr);
}

PFN_xrVoidFunction swapchain_function(const char* name) {
  MOCK_ENTRY(xrEnumerateSwapchainFormats);
  MOCK_ENTRY(xrCreateSwapchain);
  MOCK_ENTRY(xrDestroySwapchain);
  MOCK_ENTRY(xrEnumerateSwapchainImages);
  MOCK_ENTRY(xrAcquireSwapchainImage);
  MOCK_ENTRY(xrWaitSwapchainImage);
  MOCK_ENTRY(xrReleaseSwapchainImage);
  return nullptr;
}

}  // namespace stylet::mock_xr
