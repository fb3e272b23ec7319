#include "engine/session/probe_hand.h"

#include "engine/session/coupled_loops.h"

#include <algorithm>
#include <cmath>

namespace stylet::session {
namespace {

/// Turns of a ProbeMove that make `rotation`: Rz(twist) Ry(rock) Rx(tilt).
void set_turns(content::ProbeMove& move, const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d r = rotation.toRotationMatrix();
  move.rock = std::asin(std::clamp(-r(2, 0), -1.0, 1.0));
  move.tilt = std::atan2(r(2, 1), r(2, 2));
  move.twist = std::atan2(r(1, 0), r(0, 0));
}

}  // namespace

bool ProbeHand::follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double time_s) {
  const physics::RigidPose scene = probe_pose(scene_, time_s);
  if (!hand_) {
    const std::optional<physics::RigidPose> held = content::moved_on_skin(scene, scene_.labels, probe_.moved());
    if (!held) return false;
    hand_.emplace(haptic::Workspace{.start = held->position, .start_orientation = held->orientation});
  }
  hand_->follow(position, orientation);

  const Eigen::Vector3d offset = scene.orientation.conjugate() * (hand_->position() - scene.position);
  content::ProbeMove to{.lateral = offset.x(), .elevation = offset.y()};
  const std::optional<physics::RigidPose> on_skin = content::moved_on_skin(scene, scene_.labels, to);
  if (!on_skin) return false;
  const Eigen::Vector3d inwards = on_skin->orientation * Eigen::Vector3d::UnitZ();
  to.press = std::clamp(inwards.dot(hand_->position() - on_skin->position), -kHighest, kDeepest);
  set_turns(to, on_skin->orientation.conjugate() * hand_->orientation());

  const content::ProbeMove from = probe_.moved();
  return probe_.move({.lateral = to.lateral - from.lateral,
                      .elevation = to.elevation - from.elevation,
                      .press = to.press - from.press,
                      .tilt = to.tilt - from.tilt,
                      .rock = to.rock - from.rock,
                      .twist = to.twist - from.twist},
                     time_s);
}

}  // namespace stylet::session
