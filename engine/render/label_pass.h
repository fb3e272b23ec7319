// The 3-D view once more, as labels and depths instead of colours: for people who train networks on it.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/render/geometry.h"
#include "engine/render/view_options.h"
#include "shaders/shared.h"

#include <cstdint>
#include <vector>

namespace stylet::render {

/// Of each pixel, row by row from the top.
struct ViewLabels {
  std::vector<std::uint8_t> labels;  ///< indices of content::PictureLabels, 0: no surface
  std::vector<std::uint16_t> depth;  ///< along the viewing direction, in kDepthUnit; 0: no surface, 65535: or farther
};

/// Draws the nearest surface at the centre of each pixel, translucent ones as opaque ones; the ultrasound plane is no
/// surface, and what stands in the room hides but has no label. Not smoothed: a pixel has one label.
class LabelPass {
public:
  LabelPass(gpu::Device& device, int width, int height, int views);

  /// What the frame shows, beside what is always there.
  struct Shown {
    bool needle = false;
    bool syringe = false;
    bool shot = false;
    std::size_t cores = 0;
    bool panel = false;
    SeeThrough see_through = SeeThrough::window;
  };

  /// Submits and waits. @param frame, drawn, indices  as the renderer filled them
  void draw(const Geometry& geometry, const gpu::Buffer& frame, const gpu::Buffer& drawn, const gpu::Buffer& indices,
            const Shown& shown);
  ViewLabels read(std::uint32_t layer) const;

private:
  gpu::Device& device_;
  VkExtent2D size_;
  gpu::Image target_;
  gpu::Image depth_;
  struct Pass {
    gpu::RenderPassHandle render_pass;
    gpu::FramebufferHandle framebuffer;
    gpu::GraphicsPipeline pipeline;
  };
  std::vector<Pass> passes_;  ///< over the same images, for some of the views
};

}  // namespace stylet::render
