#include "engine/gpu/image.h"

namespace stylet::gpu {

namespace {

bool is_depth(VkFormat format) {
  return format == VK_FORMAT_D32_SFLOAT || format == VK_FORMAT_D16_UNORM;
}

}  // namespace

std::uint32_t texel_bytes(VkFormat format) {
  switch (format) {
    case VK_FORMAT_R8_UNORM:
    case VK_FORMAT_R8_SNORM:
    case VK_FORMAT_R8_UINT:
    case VK_FORMAT_R8_SINT:
      return 1;
    case VK_FORMAT_R16_SFLOAT:
    case VK_FORMAT_R16_UINT:
    case VK_FORMAT_D16_UNORM:
    case VK_FORMAT_R8G8_UNORM:
      return 2;
    case VK_FORMAT_R8G8B8A8_UNORM:
    case VK_FORMAT_R8G8B8A8_SRGB:
    case VK_FORMAT_B8G8R8A8_UNORM:
    case VK_FORMAT_B8G8R8A8_SRGB:
    case VK_FORMAT_R32_SFLOAT:
    case VK_FORMAT_R32_UINT:
    case VK_FORMAT_R32_SINT:
    case VK_FORMAT_R16G16_SFLOAT:
    case VK_FORMAT_D32_SFLOAT:
      return 4;
    case VK_FORMAT_R16G16B16A16_SFLOAT:
    case VK_FORMAT_R32G32_SFLOAT:
      return 8;
    case VK_FORMAT_R32G32B32A32_SFLOAT:
      return 16;
    default:
      throw GpuError("gpu::Image: format " + std::to_string(format) + " is not in texel_bytes(); add it there");
  }
}

Image::Image(Device& device, const ImageSettings& settings) : settings_(settings) {
  VkImageCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
  create.imageType = settings.depth > 1 ? VK_IMAGE_TYPE_3D : VK_IMAGE_TYPE_2D;
  create.format = settings.format;
  create.extent = extent();
  create.mipLevels = 1;
  create.arrayLayers = settings.layers;
  create.samples = settings.samples;
  create.tiling = VK_IMAGE_TILING_OPTIMAL;
  create.usage = settings.usage;
  VkImageFormatProperties limits;
  if (vkGetPhysicalDeviceImageFormatProperties(device.physical(), create.format, create.imageType, create.tiling,
                                               create.usage, 0, &limits) != VK_SUCCESS ||
      settings.width > limits.maxExtent.width || settings.height > limits.maxExtent.height ||
      settings.depth > limits.maxExtent.depth || settings.layers > limits.maxArrayLayers ||
      (limits.sampleCounts & settings.samples) == 0) {
    throw GpuError("gpu::Image: " + device.identity().name + " has no image of " + std::to_string(settings.width) +
                   "x" + std::to_string(settings.height) + "x" + std::to_string(settings.depth) + ", " +
                   std::to_string(settings.layers) + " layer(s), format " + std::to_string(settings.format) +
                   "; choose a smaller size or another GPU (--gpu)");
  }
  VkImage image = VK_NULL_HANDLE;
  check(vkCreateImage(device.handle(), &create, nullptr, &image), "vkCreateImage");
  image_ = ImageHandle(device.handle(), image);
  VkMemoryRequirements requirements;
  vkGetImageMemoryRequirements(device.handle(), image, &requirements);
  memory_ = device.allocate(requirements, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  check(vkBindImageMemory(device.handle(), image, memory_.get(), 0), "vkBindImageMemory");
  create_view(device);
}

Image::Image(Device& device, VkImage borrowed, const ImageSettings& settings)
    : settings_(settings), borrowed_(borrowed) {
  create_view(device);
}

void Image::create_view(Device& device) {
  constexpr VkImageUsageFlags kViewed =
      VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT |
      VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_INPUT_ATTACHMENT_BIT;
  if ((settings_.usage & kViewed) == 0) return;  // only copied: Vulkan allows no view of such an image
  VkImageViewCreateInfo create{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
  create.image = handle();
  create.viewType = VK_IMAGE_VIEW_TYPE_2D;
  if (settings_.layers > 1 || settings_.array_view) create.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
  if (settings_.depth > 1) create.viewType = VK_IMAGE_VIEW_TYPE_3D;
  create.format = settings_.format;
  create.subresourceRange = range();
  VkImageView view = VK_NULL_HANDLE;
  check(vkCreateImageView(device.handle(), &create, nullptr, &view), "vkCreateImageView");
  view_ = ImageViewHandle(device.handle(), view);
}

VkImageSubresourceRange Image::range() const {
  const VkImageAspectFlags aspect =
      is_depth(settings_.format) ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
  return {aspect, 0, 1, 0, settings_.layers};
}

VkDeviceSize Image::layer_bytes() const {
  return VkDeviceSize{settings_.width} * settings_.height * settings_.depth * texel_bytes(settings_.format);
}

void Image::transition(VkCommandBuffer commands, const Access& next, bool discard) const {
  const auto needed = tracker_.use(next, discard);
  if (!needed) return;
  VkImageMemoryBarrier2 barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2};
  barrier.srcStageMask = needed->src_stages;
  barrier.srcAccessMask = needed->src_access;
  barrier.dstStageMask = needed->dst_stages;
  barrier.dstAccessMask = needed->dst_access;
  barrier.oldLayout = needed->old_layout;
  barrier.newLayout = needed->new_layout;
  barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = handle();
  barrier.subresourceRange = range();
  VkDependencyInfo info{VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

Sampler::Sampler(Device& device, const SamplerSettings& settings) {
  VkSamplerCreateInfo create{VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
  create.magFilter = settings.filter;
  create.minFilter = settings.filter;
  create.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
  create.addressModeU = settings.address;
  create.addressModeV = settings.address;
  create.addressModeW = settings.address;
  create.borderColor = settings.border;
  create.compareEnable = settings.shadow;
  create.compareOp = VK_COMPARE_OP_GREATER_OR_EQUAL;
  VkSampler sampler = VK_NULL_HANDLE;
  check(vkCreateSampler(device.handle(), &create, nullptr, &sampler), "vkCreateSampler");
  sampler_ = SamplerHandle(device.handle(), sampler);
}

}  // namespace stylet::gpu
