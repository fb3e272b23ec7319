// What may change from one picture of the 3-D view to the next, beside the state and the eyes.
#pragma once

#include "engine/gpu/image.h"

#include <Eigen/Core>

namespace stylet::render {

/// The ultrasound image as a texture of the imaging plane: pixel (u, v) lies at origin + (u, v) * metres_per_pixel in
/// (x, z) of the probe frame; the grey value is its red channel.
struct PlaneTexture {
  const gpu::Image* image = nullptr;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  double metres_per_pixel = 0;
};

struct ViewOptions {
  PlaneTexture plane{};  ///< none: the imaging plane is a pane of light
};

}  // namespace stylet::render
