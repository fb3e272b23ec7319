// How each kind of surface is drawn: one pipeline a kind, all with the same resources.
#pragma once

#include "engine/gpu/pipeline.h"
#include "shaders/shared.h"

#include <vector>

namespace stylet::render {

class SurfacePipelines {
public:
  /// @param room  the ground is the room's floor and walls
  SurfacePipelines(gpu::Device& device, VkRenderPass render_pass, bool antialias, bool room);

  /// @param kind  SurfaceStyle::kind
  const gpu::GraphicsPipeline& surface(std::uint32_t kind) const { return by_kind_[kind]; }
  const gpu::GraphicsPipeline& ground() const { return ground_; }
  const gpu::GraphicsPipeline& fan() const { return fan_; }
  /// Depth alone, before the colour of a piece of this kind: glass, cover or cloth.
  const gpu::GraphicsPipeline& depth(std::uint32_t kind) const {
    return kind == kCloth ? cloth_depth_ : kind == kCover ? cover_depth_ : depth_;
  }

private:
  std::vector<gpu::GraphicsPipeline> by_kind_;
  gpu::GraphicsPipeline ground_;
  gpu::GraphicsPipeline fan_;
  gpu::GraphicsPipeline depth_;
  gpu::GraphicsPipeline cloth_depth_;
  gpu::GraphicsPipeline cover_depth_;
};

/// What all of them are given at set 0: frame, drawn vertices, ultrasound image, screen's picture, shadow map.
gpu::Interface surface_interface();

}  // namespace stylet::render
