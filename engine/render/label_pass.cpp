#include "engine/render/label_pass.h"

#include "engine/render/render_pass.h"

#include <utility>

#include "shaders/label.frag.h"
#include "shaders/surface.vert.h"

namespace stylet::render {
namespace {

gpu::ImageSettings attachment(int width, int height, int views, VkFormat format, VkImageUsageFlags usage) {
  return {.width = static_cast<std::uint32_t>(width),
          .height = static_cast<std::uint32_t>(height),
          .layers = static_cast<std::uint32_t>(views),
          .format = format,
          .usage = usage,
          .array_view = true};
}

gpu::GraphicsSettings label_pipeline(VkRenderPass render_pass) {
  gpu::GraphicsSettings settings;
  settings.vertex = surface_vert;
  settings.fragment = label_frag;
  settings.interface = {.slots = {gpu::Slot::uniform_buffer, gpu::Slot::storage_buffer},
                        .push_constant_bytes = sizeof(SurfaceStyle)};
  settings.render_pass = render_pass;
  settings.cull = VK_CULL_MODE_BACK_BIT;
  settings.depth_test = true;
  settings.depth_write = true;
  return settings;
}

}  // namespace

LabelPass::LabelPass(gpu::Device& device, int width, int height, int views)
    : device_(device),
      size_{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)},
      target_(device, attachment(width, height, views, VK_FORMAT_R32_UINT,
                                 VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT)),
      depth_(device,
             attachment(width, height, views, VK_FORMAT_D32_SFLOAT, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT)) {
  for (const std::uint32_t mask : view_masks(device, views)) {
    gpu::RenderPassHandle pass = make_render_pass(device, target_, depth_, target_, mask);
    gpu::FramebufferHandle framebuffer = make_framebuffer(device, pass.get(), target_, depth_, target_);
    gpu::GraphicsPipeline pipeline(device, label_pipeline(pass.get()));
    passes_.push_back({std::move(pass), std::move(framebuffer), std::move(pipeline)});
  }
}

void LabelPass::draw(const Geometry& geometry, const gpu::Buffer& frame, const gpu::Buffer& drawn,
                     const gpu::Buffer& indices, const Shown& shown) {
  gpu::run_now(device_, [&](gpu::Commands& commands) {
    const auto resources = {gpu::read(0, frame), gpu::read(1, drawn)};
    commands.prepare_draw(resources);
    commands.transition(indices, gpu::kIndexRead);
    const VkCommandBuffer cmd = commands.handle();
    for (const Pass& pass : passes_) {
      const bool first = &pass == passes_.data();  // the others keep what it has drawn
      commands.transition(depth_, gpu::kDepthAttachment, first);
      commands.transition(target_, gpu::kColourAttachment, first);
      begin_render_pass(cmd, pass.render_pass.get(), pass.framebuffer.get(), size_);
      vkCmdBindIndexBuffer(cmd, indices.handle(), 0, VK_INDEX_TYPE_UINT32);
      const auto draw_piece = [&](const Piece& piece) {
        commands.bind(pass.pipeline, resources, piece.style);
        vkCmdDrawIndexed(cmd, piece.index_count, 1, piece.first_index, 0, 0);
      };
      const auto draw_pieces = [&](const std::vector<Piece>& pieces) {
        for (const Piece& piece : pieces) draw_piece(piece);
      };
      if (shown.panel) {
        draw_pieces(geometry.panel);
        draw_piece(geometry.panel_picture);
      }
      if (shown.see_through != SeeThrough::glass) draw_pieces(geometry.drape);
      draw_pieces(geometry.room);
      draw_pieces(geometry.solids);
      if (shown.cores > 0 && shown.see_through != SeeThrough::closed) draw_piece(geometry.first_cores(shown.cores));
      draw_pieces(geometry.glass);
      draw_pieces(geometry.covers);
      if (shown.see_through != SeeThrough::glass) draw_pieces(geometry.lining);
      if (shown.needle) draw_pieces(geometry.needle_pieces);
      if (shown.shot) draw_piece(geometry.shot_piece);
      if (shown.syringe) {
        draw_pieces(geometry.syringe_pieces);
        draw_piece(geometry.barrel);
      }
      const VkSubpassEndInfo end{VK_STRUCTURE_TYPE_SUBPASS_END_INFO};
      vkCmdEndRenderPass2(cmd, &end);
    }
  });
}

ViewLabels LabelPass::read(std::uint32_t layer) const {
  ViewLabels view;
  for (const std::uint32_t word : gpu::read_back<std::uint32_t>(device_, target_, layer)) {
    view.labels.push_back(static_cast<std::uint8_t>(word & 0xFF));
    view.depth.push_back(static_cast<std::uint16_t>(word >> 8));
  }
  return view;
}

}  // namespace stylet::render
