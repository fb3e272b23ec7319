#include "engine/view/composition.h"

#include <array>
#include <cstdint>
#include <span>

#include "shaders/smooth_edges.comp.h"

namespace stylet::view {

namespace {

// Where there is no picture: as light, and as the bytes that the screen gets for it.
constexpr std::array<float, 4> kGround{0.0044F, 0.0048F, 0.006F, 1};
constexpr std::array<float, 4> kGroundBytes{14 / 255.0F, 15 / 255.0F, 18 / 255.0F, 1};

void remake_if_needed(std::optional<gpu::Image>& image, gpu::Device& device, std::uint32_t width,
                      std::uint32_t height, VkFormat format = VK_FORMAT_R8G8B8A8_SRGB) {
  if (image && image->extent().width == width && image->extent().height == height && image->format() == format)
    return;
  device.wait_idle();
  image.reset();
  image.emplace(device,
                gpu::ImageSettings{.width = width,
                                   .height = height,
                                   .format = format,
                                   .usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
}

void blit(gpu::Commands& commands, const gpu::Image& from, std::uint32_t layer, const gpu::Image& to,
          const picture::Pane& pane) {
  const VkExtent3D size = from.extent();
  const picture::Pane fit = picture::fitted(pane, static_cast<int>(size.width), static_cast<int>(size.height));
  if (fit.width == 0) return;
  commands.transition(from, gpu::kTransferRead);
  commands.transition(to, gpu::kTransferWrite);
  VkImageBlit region{};
  region.srcSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, layer, 1};
  region.srcOffsets[1] = {static_cast<std::int32_t>(size.width), static_cast<std::int32_t>(size.height), 1};
  region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.dstOffsets[0] = {fit.x, fit.y, 0};
  region.dstOffsets[1] = {fit.x + fit.width, fit.y + fit.height, 1};
  vkCmdBlitImage(commands.handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_LINEAR);
}

/// Whether a picture of one layer, in its pane, leaves nothing of `target` to be seen.
bool covers(const gpu::Image& target, const gpu::Image& picture, const picture::Pane& pane) {
  const VkExtent3D size = picture.extent(), whole = target.extent();
  const picture::Pane fit = picture::fitted(pane, static_cast<int>(size.width), static_cast<int>(size.height));
  return fit.x <= 0 && fit.y <= 0 && fit.x + fit.width >= static_cast<int>(whole.width) &&
         fit.y + fit.height >= static_cast<int>(whole.height);
}

/// The same bytes in another format of the same size.
void copy_bytes(gpu::Commands& commands, const gpu::Image& from, const gpu::Image& to) {
  commands.transition(from, gpu::kTransferRead);
  commands.transition(to, gpu::kTransferWrite, true);
  VkImageCopy region{};
  region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.extent = from.extent();
  vkCmdCopyImage(commands.handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
}

bool enlarged(const gpu::Image& picture, const picture::Pane& pane) {
  const VkExtent3D size = picture.extent();
  const picture::Pane fit = picture::fitted(pane, static_cast<int>(size.width), static_cast<int>(size.height));
  return fit.width > static_cast<int>(size.width);
}

}  // namespace

Composition::Smoothing::Smoothing(gpu::Device& device, VkExtent3D size)
    : pipeline(device, smooth_edges_comp, {.slots = {gpu::Slot::sampled_image, gpu::Slot::storage_image}}),
      sampler(device),
      from(device, {.width = size.width, .height = size.height}),
      to(device, {.width = size.width,
                  .height = size.height,
                  .usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT}) {}

void Composition::record(gpu::Commands& commands, const gpu::Image& target, const FrameParts& frame) {
  const auto& [scene, ultrasound, plot, overlay, layout] = frame;
  const picture::Pane& scene_pane = layout.scene;
  const auto eyes = scene != nullptr ? static_cast<int>(scene->settings().layers) : 0;
  timestamps_.reset(commands);
  timestamps_.mark(commands, "start");
  const bool smooth = eyes == 1 && scene->format() == VK_FORMAT_R8G8B8A8_SRGB && enlarged(*scene, scene_pane);
  const gpu::Image* shown = scene;
  const gpu::Image* onto = &target;
  VkFormat meant = VK_FORMAT_R8G8B8A8_SRGB;  // of pictures, when they are scaled
  if (smooth) {
    shown = &smoothed(commands, *scene);
    timestamps_.mark(commands, "smooth_edges");
    // Scaled as the bytes are: a software rasterizer takes longer to light and back.
    meant = VK_FORMAT_R8G8B8A8_UNORM;
    remake_if_needed(
        bytes_, device_, target.extent().width, target.extent().height,
        target.format() == VK_FORMAT_B8G8R8A8_SRGB ? VK_FORMAT_B8G8R8A8_UNORM : VK_FORMAT_R8G8B8A8_UNORM);
    onto = &*bytes_;
  }
  if (eyes != 1 || !covers(target, *scene, scene_pane)) commands.clear(*onto, smooth ? kGroundBytes : kGround);
  for (int eye = 0; eye < eyes; ++eye)
    blit(commands, *shown, static_cast<std::uint32_t>(eye), *onto,
         {scene_pane.x + scene_pane.width * eye / eyes, scene_pane.y, scene_pane.width / eyes, scene_pane.height});
  if (ultrasound != nullptr)
    blit(commands, ultrasound->format() == meant ? *ultrasound : twin(commands, *ultrasound, ultrasound_copy_, meant),
         0, *onto, layout.ultrasound);
  if (smooth) copy_bytes(commands, *bytes_, target);
  if (plot != nullptr && plot->width > 0) {
    remake_if_needed(plot_copy_, device_, static_cast<std::uint32_t>(plot->width),
                     static_cast<std::uint32_t>(plot->height));
    commands.upload(*plot_copy_, std::as_bytes(std::span(plot->rgba)));
    blit(commands, *plot_copy_, 0, target, layout.plot);
  }
  if (overlay != nullptr) overlay->draw(commands, target);
  timestamps_.mark(commands, "compose");
}

const gpu::Image& Composition::smoothed(gpu::Commands& commands, const gpu::Image& scene) {
  const VkExtent3D size = scene.extent();
  if (!smoothing_ || smoothing_->from.extent().width != size.width ||
      smoothing_->from.extent().height != size.height) {
    device_.wait_idle();
    smoothing_.reset();
    smoothing_.emplace(device_, size);
  }
  copy_bytes(commands, scene, smoothing_->from);
  commands.dispatch(smoothing_->pipeline,
                    {gpu::sample(0, smoothing_->from, smoothing_->sampler), gpu::write(1, smoothing_->to)},
                    {(size.width + 15) / 16, (size.height + 3) / 4, 1});
  return smoothing_->to;
}

const gpu::Image& Composition::twin(gpu::Commands& commands, const gpu::Image& picture,
                                    std::optional<gpu::Image>& twin, VkFormat format) {
  remake_if_needed(twin, device_, picture.extent().width, picture.extent().height, format);
  copy_bytes(commands, picture, *twin);
  return *twin;
}

}  // namespace stylet::view
