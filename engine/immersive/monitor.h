// The session's monitor in the room: a picture that Dear ImGui draws.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/view/overlay.h"

namespace stylet::immersive {

/// One at a time, and no other view::Overlay beside it. Thread: the one that uses the device.
class Monitor {
public:
  // Pixels. An em is 1/37 of the width: 0.9 degrees or more from where the scenarios' trainees stand, and more texels
  // there than a headset has pixels.
  static constexpr int kWidth = 1056, kHeight = 528;

  /// @throws gpu::GpuError
  explicit Monitor(gpu::Device& device);
  ~Monitor();
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Until end() the functions of ImGui make its panels.
  /// @param dt_s  since the frame before
  void begin(double dt_s);
  void end();
  /// As last drawn. R8G8B8A8_SRGB.
  const gpu::Image& picture() const { return picture_; }

private:
  gpu::Device& device_;
  gpu::Image picture_;
  view::Overlay overlay_;
  gpu::FrameRing ring_;
};

}  // namespace stylet::immersive
