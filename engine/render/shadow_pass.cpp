#include "engine/render/shadow_pass.h"

#include "engine/render/render_pass.h"

#include <cmath>

#include "shaders/shadow.vert.h"
#include "shaders/shadow_cloth.frag.h"

namespace stylet::render {

namespace {

constexpr std::uint32_t kTexels = 1024;
constexpr double kReach =
    0.38;  // tangent of half the map's angle: 40 cm round the field, a needle is two texels wide
constexpr float kOffset = 0.0021F;  // m, more than the filter is wide

gpu::GraphicsSettings pipeline(VkRenderPass render_pass, bool cloth) {
  gpu::GraphicsSettings settings;
  settings.vertex = shadow_vert;
  if (cloth) settings.fragment = shadow_cloth_frag;
  settings.interface = {.slots = {gpu::Slot::uniform_buffer, gpu::Slot::storage_buffer}};
  settings.render_pass = render_pass;
  settings.depth_test = true;
  settings.depth_write = true;
  settings.blend = {};
  return settings;
}

}  // namespace

ShadowPass::ShadowPass(gpu::Device& device, bool shadows)
    : shadows_(shadows),
      map_(device, {.width = shadows ? kTexels : 1,
                    .height = shadows ? kTexels : 1,
                    .format = VK_FORMAT_D32_SFLOAT,
                    .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT}),
      sampler_(device, {.shadow = true}),
      render_pass_(make_depth_pass(device, map_)),
      framebuffer_(make_framebuffer(device, render_pass_.get(), map_)) {
  if (!shadows) return;
  solid_.emplace(device, pipeline(render_pass_.get(), false));
  cloth_.emplace(device, pipeline(render_pass_.get(), true));
}

void ShadowPass::draw(gpu::Commands& commands, const Geometry& geometry, const gpu::Buffer& frame,
                      const gpu::Buffer& drawn, const gpu::Buffer& indices, const Shown& shown) const {
  if (!shadows_) return;
  const auto resources = {gpu::read(0, frame), gpu::read(1, drawn)};
  commands.prepare_draw(resources);
  commands.transition(indices, gpu::kIndexRead);
  commands.transition(map_, gpu::kDepthAttachment, true);
  const VkCommandBuffer cmd = commands.handle();
  begin_render_pass(cmd, render_pass_.get(), framebuffer_.get(), {kTexels, kTexels});
  vkCmdBindIndexBuffer(cmd, indices.handle(), 0, VK_INDEX_TYPE_UINT32);
  const auto draw_piece = [&](const gpu::GraphicsPipeline& pipeline, const Piece& piece) {
    commands.bind(pipeline, resources);
    vkCmdDrawIndexed(cmd, piece.index_count, 1, piece.first_index, 0, 0);
  };
  draw_piece(*solid_, geometry.probe());
  if (geometry.cable) draw_piece(*solid_, geometry.cable_piece);
  if (shown.needle)
    for (const Piece& piece : geometry.needle_pieces) draw_piece(*solid_, piece);
  if (shown.syringe) {
    for (const Piece& piece : geometry.syringe_pieces) draw_piece(*solid_, piece);
    draw_piece(*solid_, geometry.barrel);
  }
  if (shown.drape) {
    for (const Piece& piece : geometry.drape_closed) draw_piece(*solid_, piece);
    for (const Piece& piece : geometry.drape_open) draw_piece(*cloth_, piece);
  }
  const VkSubpassEndInfo end{VK_STRUCTURE_TYPE_SUBPASS_END_INFO};
  vkCmdEndRenderPass2(cmd, &end);
}

vec4 ShadowPass::uniform() const {
  return {shadows_ ? 1.0F : 0.0F, 1.0F / kTexels, kOffset, 0};
}

Eye lamp_eye(const RoomLayout& layout) {
  EyeView view;
  const Eigen::Vector3d back = -layout.lamp_axis;
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(back).normalized();
  Eigen::Isometry3d table_from_lamp = Eigen::Isometry3d::Identity();
  table_from_lamp.translation() = layout.lamp;
  table_from_lamp.linear().col(0) = right;
  table_from_lamp.linear().col(1) = back.cross(right);
  table_from_lamp.linear().col(2) = back;
  view.patient_from_eye = layout.patient_from_table * table_from_lamp;
  view.right = view.up = std::atan(kReach);
  view.left = view.down = -view.right;
  return eye_of(view);
}

}  // namespace stylet::render
