// The scene as a headset shows it: from where the trainee stands, in the size that the runtime wants.
#pragma once

#include "engine/content/scene.h"
#include "engine/headset/headset.h"
#include "engine/render/renderer.h"
#include "engine/session/newest_needle.h"

#include <array>
#include <optional>

namespace stylet::immersive {

/// Where the trainee's head is at the start: at the eye of the scene's camera, turned as it looks, in the room.
Eigen::Isometry3d standing_place(const content::Scene& scene);

/// Where the trainee stands on the floor of the room: beside the table, turned to the field.
Eigen::Isometry3d floor_place(const content::Scene& scene);

/// The eyes of a frame, for the renderer.
std::array<render::EyeView, 2> eyes_in_patient(const content::Scene& scene, const headset::HeadsetFrame& frame);

/// What a frame shows beside the simulation's state.
struct Pictures {
  render::PlaneTexture plane{};        ///< the image in the probe's plane
  const gpu::Image* screen = nullptr;  ///< of the ultrasound machine
  const gpu::Image* panel = nullptr;   ///< on the session's monitor; null: there is none
  render::SeeThrough see_through = render::SeeThrough::window;
  session::NewestNeedle* needle = nullptr;  ///< shown in place of the state's: the hand sees no added delay
};

/// Thread: the one that uses the device.
class ImmersiveView {
public:
  /// Keeps references.
  ImmersiveView(gpu::Device& device, const content::Scene& scene) : device_(device), scene_(scene) {}
  ~ImmersiveView();
  ImmersiveView(const ImmersiveView&) = delete;
  ImmersiveView& operator=(const ImmersiveView&) = delete;

  /// Both eyes, left in layer 0. The renderer is made anew when the frame wants another size.
  /// @throws gpu::GpuError
  const gpu::Image& draw(const headset::HeadsetFrame& frame, const state::FrameState& state,
                         const Pictures& pictures);

private:
  gpu::Device& device_;
  const content::Scene& scene_;
  headset::EyeSize size_;
  std::optional<render::Renderer> renderer_;
};

}  // namespace stylet::immersive
