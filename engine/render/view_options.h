// What may change from one picture of the 3-D view to the next, beside the state and the eyes.
#pragma once

#include "engine/gpu/image.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

namespace stylet::render {

/// The ultrasound image as a texture of the imaging plane: pixel (u, v) lies at origin + (u, v) * metres_per_pixel in
/// (x, z) of the probe frame; the grey value is its red channel.
struct PlaneTexture {
  const gpu::Image* image = nullptr;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  double metres_per_pixel = 0;
};

/// How far one sees into the patient.
enum class SeeThrough : std::uint8_t {
  closed,  ///< skin and drape, as in life
  window,  ///< an opening round the target shows the organs, for teaching
  glass,   ///< no drape, all of skin and organs clear, for instructors
};

/// Poses of the needle's nodes, hub first, patient frame; as many as the state has.
struct NeedlePose {
  std::span<Eigen::Vector3f> positions;
  std::span<Eigen::Quaternionf> orientations;
};

struct ViewOptions {
  PlaneTexture plane{};  ///< none: the imaging plane is a pane of light
  /// What the ultrasound machine's screen shows, whole; null: it is dark. RGBA of 8 bits that mean sRGB.
  const gpu::Image* screen = nullptr;
  /// What the session's monitor shows, as `screen`; null: it is not in the room.
  const gpu::Image* panel = nullptr;
  SeeThrough see_through = SeeThrough::window;
  /// Where the trainee's controllers are, patient frame, each by its grip (see controller_rods()); none: it is not
  /// seen. That which leads the needle is pink as its hub.
  std::optional<Eigen::Isometry3d> needle_hand{};
  std::optional<Eigen::Isometry3d> probe_hand{};
  /// Pixels of a picture of one view that something opaque will lie on: they are not drawn, what they hold means
  /// nothing.
  VkRect2D hidden{};
  /// Another one whenever what `plane`, `screen` or `panel` hold has changed: a frame in which neither they nor
  /// anything else has is not drawn again. None: they may have.
  std::optional<std::uint64_t> pictures{};
  /// Called when all else of the frame is ready, right before it goes to the GPU: overwrites the state's pose of the
  /// needle with the newest, so that the hand sees it without the frame's delay. Must not throw. Empty: the state's
  /// pose is drawn. Not called where the state has no needle.
  std::function<void(NeedlePose)> latch_needle{};
};

}  // namespace stylet::render
