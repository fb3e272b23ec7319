// An image with its own memory and one view of all of it, and samplers.
#pragma once

#include "engine/gpu/access.h"
#include "engine/gpu/device.h"

#include <cstdint>

namespace stylet::gpu {

/// Usual sets of VK_IMAGE_USAGE_* bits.
inline constexpr VkImageUsageFlags kTextureUsage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
inline constexpr VkImageUsageFlags kStorageUsage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                                                   VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
inline constexpr VkImageUsageFlags kTargetUsage =
    VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;

struct ImageSettings {
  std::uint32_t width = 1;
  std::uint32_t height = 1;
  std::uint32_t depth = 1;   ///< > 1 makes a 3-D image
  std::uint32_t layers = 1;  ///< > 1 makes an array
  VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
  VkImageUsageFlags usage = kTextureUsage;
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_1_BIT;
  bool array_view = false;  ///< view as an array even with one layer (sampler2DArray, image2DArray)
};

class Image {
public:
  Image(Device& device, const ImageSettings& settings);
  /// A view of an image that someone else owns (a swapchain's, a VR runtime's).
  Image(Device& device, VkImage borrowed, const ImageSettings& settings);

  VkImage handle() const { return borrowed_ != VK_NULL_HANDLE ? borrowed_ : image_.get(); }
  VkImageView view() const { return view_.get(); }
  const ImageSettings& settings() const { return settings_; }
  VkFormat format() const { return settings_.format; }
  VkExtent3D extent() const { return {settings_.width, settings_.height, settings_.depth}; }
  VkImageSubresourceRange range() const;
  /// Bytes of one tightly packed layer (all slices of a 3-D image).
  VkDeviceSize layer_bytes() const;
  /// Records the barrier that `next` needs, if any.
  /// @param discard  the contents are about to be overwritten whole
  void transition(VkCommandBuffer commands, const Access& next, bool discard = false) const;
  /// Tracks use and layout on the queue, not contents: that is why a const image can be sampled.
  AccessTracker& tracker() const { return tracker_; }

private:
  void create_view(Device& device);

  ImageSettings settings_;
  VkImage borrowed_ = VK_NULL_HANDLE;
  ImageHandle image_;
  MemoryHandle memory_;
  ImageViewHandle view_;
  mutable AccessTracker tracker_;
};

/// Bytes of one texel of an uncompressed colour or depth format that Stylet uses; throws GpuError for others.
std::uint32_t texel_bytes(VkFormat format);

struct SamplerSettings {
  VkFilter filter = VK_FILTER_LINEAR;
  VkSamplerAddressMode address = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  VkBorderColor border = VK_BORDER_COLOR_FLOAT_TRANSPARENT_BLACK;
  bool shadow = false;  ///< compares: 1 where the reference is not less than the texel (reversed depth)
};

class Sampler {
public:
  explicit Sampler(Device& device, const SamplerSettings& settings = {});
  VkSampler handle() const { return sampler_.get(); }

private:
  SamplerHandle sampler_;
};

}  // namespace stylet::gpu
