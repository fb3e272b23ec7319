// Frames of data sets: how probe, needle, breath and tissue of frame i are drawn, and the world that they make.
//
// Frame i of a seed depends on nothing else: not on the frames before it, nor on how many there are. Its physics
// starts at rest, with the probe pressed where this frame has it; a breath is drawn and held; the needle goes the
// scenario's own way, moved a little, up to a random moment of it, and stops; then everything comes to rest. So the
// wall is dented by this frame's probe, and the needle has cut its way through this frame's tissue.
#pragma once

#include "engine/content/probe_placement.h"
#include "engine/content/scene.h"
#include "engine/state/frame_state.h"
#include "physics/loops/haptic_loop.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace stylet::session {

/// Half widths of what is drawn evenly about the scenario's values.
struct RandomRanges {
  double slide_mm = 15;        ///< of the probe on the skin, along the image ...
  double slide_across_mm = 5;  ///< ... and across it: between two ribs there is no more room
  double press_mm = 1.5;
  double tilt_deg = 10;
  double rock_deg = 8;
  double twist_deg = 8;
  double needle_shift_mm = 8;  ///< of the way of the needle, across it
  double needle_tilt_deg = 4;
  double attenuation_share = 0.2;  ///< of a tissue's attenuation
  double backscatter_db = 2;
  double impedance_share = 0.005;
  double texture_share = 0.3;
  double from_s = 0;  ///< moments of the motion that the needle stops at
  double to_s = 0;
};

/// What frame i is made of.
struct RandomFrame {
  double motion_s = 0;     ///< moment of the scenario's motion
  double inspiration = 0;  ///< share of a full breath that is held
  std::uint32_t seed = 0;  ///< of speckle and noise
  content::ProbeMove move;
  physics::RigidPose probe;
  Eigen::Isometry3d needle_move = Eigen::Isometry3d::Identity();  ///< of the way of the needle
  std::vector<content::Acoustics> tissues;                        ///< by row of Scene::tissues
  std::vector<content::MotionSample> way;  ///< of the hub, from outside the patient to where it stops; times in s
};

/// Draws frame `index` of `seed`. Poses where the probe would leave the skin are drawn again.
/// @throws files::ContentError  the scene has no motion, or no pose in the ranges lies on the skin
RandomFrame draw_random_frame(const content::Scene& scene, const RandomRanges& ranges, std::uint64_t seed,
                              std::uint64_t index);

/// Gives `scene` the probe pose, tissues and breath of the frame.
void apply_frame(content::Scene& scene, const RandomFrame& frame);

/// The world of a frame, at rest.
struct SettledFrame {
  state::FrameState state;
  double speed = 0;  ///< of the fastest node of tissue and needle at the end, m/s: how much at rest it is
};

/// @param scene  with the frame applied
/// @throws files::ContentError  the physics gave no finite state
SettledFrame settle(const content::Scene& scene, physics::Coupling coupling, const RandomFrame& frame,
                    const std::function<void(double share)>& progress = {});

}  // namespace stylet::session
