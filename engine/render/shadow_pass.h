// What the surgical lamp reaches: the depth of what it sees, drawn from where it hangs.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/render/camera.h"
#include "engine/render/geometry.h"
#include "engine/render/room_layout.h"

#include <cstdint>
#include <optional>

namespace stylet::render {

/// Without shadows the map is one texel, and FrameUniforms::shadow says so.
class ShadowPass {
public:
  ShadowPass(gpu::Device& device, bool shadows);

  /// What is there beside the probe.
  struct Shown {
    bool needle, syringe, drape;
  };
  /// Needle, syringe, probe and drape; organs lie inside and cast none. @param frame, drawn, indices  as the renderer
  /// filled them
  void draw(gpu::Commands& commands, const Geometry& geometry, const gpu::Buffer& frame, const gpu::Buffer& drawn,
            const gpu::Buffer& indices, const Shown& shown) const;
  const gpu::Image& map() const { return map_; }
  const gpu::Sampler& sampler() const { return sampler_; }
  vec4 uniform() const;

private:
  bool shadows_;
  gpu::Image map_;
  gpu::Sampler sampler_;
  gpu::RenderPassHandle render_pass_;
  gpu::FramebufferHandle framebuffer_;
  std::optional<gpu::GraphicsPipeline> solid_;
  std::optional<gpu::GraphicsPipeline> cloth_;
};

/// The lamp as an eye, as wide as the map reaches.
Eye lamp_eye(const RoomLayout& layout);

}  // namespace stylet::render
