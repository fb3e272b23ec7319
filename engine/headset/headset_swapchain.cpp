#define XR_USE_GRAPHICS_API_VULKAN
#include "engine/headset/headset_swapchain.h"

#include <openxr/openxr_platform.h>

#include <algorithm>

namespace stylet::headset {

namespace {

constexpr XrDuration kImageTimeout = 2'000'000'000;  // ns; a runtime that keeps its images longer hangs

/// The one that a rendered frame is copied to as it is, or the other order of its bytes.
VkFormat choose_format(XrSession session) {
  std::uint32_t count = 0;
  xr::check(xrEnumerateSwapchainFormats(session, 0, &count, nullptr), "xrEnumerateSwapchainFormats");
  std::vector<std::int64_t> offered(count);
  xr::check(xrEnumerateSwapchainFormats(session, count, &count, offered.data()), "xrEnumerateSwapchainFormats");
  for (const VkFormat wanted : {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB})
    if (std::find(offered.begin(), offered.end(), wanted) != offered.end()) return wanted;
  throw HeadsetError("the headset's runtime offers no 8-bit sRGB images; choose another runtime");
}

}  // namespace

HeadsetSwapchain::HeadsetSwapchain(XrSession session, gpu::Device& device, const EyeSize& size)
    : device_(device), size_(size) {
  const VkFormat format = choose_format(session);
  XrSwapchainCreateInfo create{XR_TYPE_SWAPCHAIN_CREATE_INFO};
  create.usageFlags = XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT;
  create.format = format;
  create.sampleCount = 1;
  create.width = size.width;
  create.height = size.height;
  create.faceCount = 1;
  create.arraySize = 2;
  create.mipCount = 1;
  xr::check(xrCreateSwapchain(session, &create, &swapchain_), "xrCreateSwapchain");
  try {
    std::uint32_t count = 0;
    xr::check(xrEnumerateSwapchainImages(swapchain_, 0, &count, nullptr), "xrEnumerateSwapchainImages");
    std::vector<XrSwapchainImageVulkan2KHR> images(count, {XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR});
    xr::check(xrEnumerateSwapchainImages(swapchain_, count, &count,
                                         reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data())),
              "xrEnumerateSwapchainImages");
    for (const XrSwapchainImageVulkan2KHR& image : images) {
      images_.emplace_back(device, image.image,
                           gpu::ImageSettings{.width = size.width,
                                              .height = size.height,
                                              .layers = 2,
                                              .format = format,
                                              .usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT});
      commands_.emplace_back(device);
    }
  } catch (...) {
    xrDestroySwapchain(swapchain_);
    throw;
  }
}

HeadsetSwapchain::~HeadsetSwapchain() {
  device_.settle();
  images_.clear();
  xrDestroySwapchain(swapchain_);
}

void HeadsetSwapchain::show(const gpu::Image& eyes) {
  std::uint32_t index = 0;
  xr::check(xrAcquireSwapchainImage(swapchain_, nullptr, &index), "xrAcquireSwapchainImage");
  XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO};
  wait.timeout = kImageTimeout;
  const XrResult waited = xrWaitSwapchainImage(swapchain_, &wait);
  if (waited == XR_TIMEOUT_EXPIRED)
    throw HeadsetError("the headset's runtime hands out no image for two seconds; start it again", waited);
  xr::check(waited, "xrWaitSwapchainImage");

  gpu::Commands& commands = commands_[index];
  commands.begin();
  record(commands, eyes, images_[index]);
  commands.submit();
  xr::check(xrReleaseSwapchainImage(swapchain_, nullptr), "xrReleaseSwapchainImage");
}

void HeadsetSwapchain::record(gpu::Commands& commands, const gpu::Image& from, const gpu::Image& to) const {
  // The runtime hands images out, and wants them back, as colour attachments; what it did with them is done.
  to.tracker().assume(
      {VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_NONE, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL});
  commands.transition(from, gpu::kTransferRead);
  commands.transition(to, gpu::kTransferWrite, true);
  const VkExtent3D size = from.extent();
  if (from.format() == to.format() && size.width == size_.width && size.height == size_.height) {
    VkImageCopy region{};
    region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 2};
    region.extent = size;
    vkCmdCopyImage(commands.handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  } else {
    VkImageBlit region{};
    region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 2};
    region.srcOffsets[1] = {static_cast<std::int32_t>(size.width), static_cast<std::int32_t>(size.height), 1};
    region.dstOffsets[1] = {static_cast<std::int32_t>(size_.width), static_cast<std::int32_t>(size_.height), 1};
    vkCmdBlitImage(commands.handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_LINEAR);
  }
  commands.transition(to, gpu::kColourAttachment);
}

}  // namespace stylet::headset
