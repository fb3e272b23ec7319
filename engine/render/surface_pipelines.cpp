#include "engine/render/surface_pipelines.h"

#include "shaders/background.frag.h"
#include "shaders/background.vert.h"
#include "shaders/fan.frag.h"
#include "shaders/opening.frag.h"
#include "shaders/surface.frag.h"
#include "shaders/surface.vert.h"

namespace stylet::render {

namespace {

/// Everything the pipelines have in common.
gpu::GraphicsSettings common(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings;
  settings.vertex = surface_vert;
  settings.fragment = surface_frag;
  settings.interface = surface_interface();
  settings.render_pass = render_pass;
  settings.samples = antialias ? VK_SAMPLE_COUNT_4_BIT : VK_SAMPLE_COUNT_1_BIT;
  settings.cull = VK_CULL_MODE_BACK_BIT;
  settings.depth_test = true;
  settings.depth_write = true;
  return settings;
}

gpu::GraphicsSettings of_kind(std::uint32_t kind, VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = common(render_pass, antialias);
  settings.interface.specialization = {kind};
  if (kind == kCloth) settings.cull = VK_CULL_MODE_NONE;
  if (kind == kGlass || kind == kCover || kind == kCloth) {  // its depth is laid before
    settings.depth_write = false;
    settings.depth_compare = VK_COMPARE_OP_EQUAL;
  }
  if (kind == kGlass || kind == kCover) settings.blend = {gpu::Blend::premultiplied};
  return settings;
}

gpu::GraphicsSettings ground(VkRenderPass render_pass, bool antialias, bool room) {
  gpu::GraphicsSettings settings = common(render_pass, antialias);
  settings.vertex = background_vert;
  settings.fragment = background_frag;
  settings.interface.specialization = {room ? 1u : 0u};
  settings.cull = VK_CULL_MODE_NONE;
  settings.depth_write = false;
  settings.depth_compare = VK_COMPARE_OP_GREATER_OR_EQUAL;  // where nothing was drawn the depth is 0, the ground's
  return settings;
}

gpu::GraphicsSettings fan(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = common(render_pass, antialias);
  settings.fragment = fan_frag;
  settings.cull = VK_CULL_MODE_NONE;
  settings.depth_write = false;
  settings.blend = {gpu::Blend::premultiplied};
  return settings;
}

gpu::GraphicsSettings depth_alone(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = common(render_pass, antialias);
  settings.fragment = {};
  settings.colour_write = false;
  return settings;
}

gpu::GraphicsSettings depth_beside_opening(std::uint32_t kind, VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = depth_alone(render_pass, antialias);
  settings.fragment = opening_frag;
  settings.interface.specialization = {kind};
  if (kind == kCloth) settings.cull = VK_CULL_MODE_NONE;
  return settings;
}

}  // namespace

gpu::Interface surface_interface() {
  using gpu::Slot;
  return {.slots = {Slot::uniform_buffer, Slot::storage_buffer, Slot::sampled_image, Slot::sampled_image,
                    Slot::sampled_image},
          .push_constant_bytes = sizeof(SurfaceStyle)};
}

SurfacePipelines::SurfacePipelines(gpu::Device& device, VkRenderPass render_pass, bool antialias, bool room)
    : ground_(device, stylet::render::ground(render_pass, antialias, room)),
      fan_(device, stylet::render::fan(render_pass, antialias)),
      depth_(device, depth_alone(render_pass, antialias)),
      cloth_depth_(device, depth_beside_opening(kCloth, render_pass, antialias)),
      cover_depth_(device, depth_beside_opening(kCover, render_pass, antialias)) {
  by_kind_.reserve(kKinds);
  for (std::uint32_t kind = 0; kind < kKinds; ++kind)
    by_kind_.emplace_back(device, of_kind(kind, render_pass, antialias));
}

}  // namespace stylet::render
