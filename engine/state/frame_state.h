// One time-stamped picture of the simulated world: what a renderer needs to draw a frame.
#pragma once

#include "engine/content/heated_zone.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace stylet::state {

/// A target as the tissue carries it.
struct TargetState {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float distance = 0;  ///< of the tip from there, m
};

/// A part of a core that is of one tissue: shares of the core's length, from the needle's tip on, and of its width.
struct CorePiece {
  float from = 0;
  float to = 0;
  float low = 0;
  float high = 1;
  int tissue = 0;       ///< index into Scene::tissues; 0: a gap
  bool target = false;  ///< of a target's tissue

  /// Of its tissue's linear colour that it is drawn with: targets' tissue stands out.
  float shade() const { return target ? 1.0F : 0.4F; }
};

/// A core that was cut, where it lay at that moment.
struct CoreTrack {
  Eigen::Vector3f from = Eigen::Vector3f::Zero();  ///< the needle's tip
  Eigen::Vector3f to = Eigen::Vector3f::Zero();
  float radius = 0;
  float target_share = 0;
  double fired_s = 0;               ///< session time
  float throw_length = 0;           ///< how far the needle shot, m
  std::vector<CorePiece> pieces{};  ///< fill length and width

  float length() const { return (to - from).norm(); }  ///< m
};

/// A syringe on the needle.
struct SyringeState {
  float capacity = 0;  ///< m^3
  float held = 0;      ///< fluid in it, m^3
};

/// A frame without its bodies: what is small of it.
struct FrameDetails {
  double time_s = 0;  ///< session time
  std::uint64_t simulation_step = 0;
  std::uint64_t haptic_step = 0;
  std::vector<Eigen::Vector3f> needle_positions;  ///< [needle node] hub first
  std::vector<Eigen::Quaternionf> needle_orientations;
  Eigen::Vector3f probe_position = Eigen::Vector3f::Zero();
  Eigen::Quaternionf probe_orientation = Eigen::Quaternionf::Identity();
  Eigen::Vector3f breath = Eigen::Vector3f::Zero();  ///< motion of rigid organs that breathe, m
  Eigen::Vector3f force = Eigen::Vector3f::Zero();   ///< on the hand
  float force_scale = 1;                             ///< of it that a stylus with force is given
  float force_clipped = 0;                           ///< 1: the stylus cannot give it
  float insertion_depth = 0;                         ///< arc length of needle in tissue, m
  std::vector<TargetState> targets;                  ///< [targets]
  float probe_force = 0;                             ///< that presses the probe on the skin, along its axis, N
  float probe_area = 0;                              ///< of the skin that it touches, m^2
  float probe_lifted = 0;                            ///< 1: it is to press a body and touches nothing

  // What the procedure shows, at the moment that the frame was asked for: not interpolated, not in the buffer.
  std::shared_ptr<const content::HeatedZone> zone{};  ///< null: nothing was destroyed
  std::vector<CoreTrack> cores{};
  std::vector<float> cavity_shares{};  ///< [cavities of the scene] of the volume at rest that is left
  std::optional<SyringeState> syringe{};

  /// The target that the tip is nearest to; null: there is none.
  const TargetState* nearest_target() const {
    const auto nearest = std::ranges::min_element(targets, {}, &TargetState::distance);
    return nearest == targets.end() ? nullptr : &*nearest;
  }
};

/// Patient frame, metres, newtons. Arrays are sized at load and never grow.
struct FrameState : FrameDetails {
  std::vector<std::vector<Eigen::Vector3f>> bodies;  ///< [body][node] deformed positions
};

/// How a FrameState was made.
enum class Provenance : std::uint8_t {
  none,          ///< nothing was published yet
  exact,         ///< a published state
  interpolated,  ///< between two published states
  held,          ///< asked beyond what was published: the nearest one, unchanged
};

}  // namespace stylet::state
