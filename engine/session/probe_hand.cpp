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

SkinCoupling::Press ProbeHand::press(const Under& under) const {
  const double depth = under.inwards.dot(hand_->position() - under.position);
  if (skin_ == nullptr) return {.depth = std::min(depth, kDeepest)};
  const Skin& skin = skin_->newest();
  return coupling_.press(depth, speed_, skin, under.inwards.dot(skin.position - under.position));
}

Eigen::Vector3d ProbeHand::force(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation,
                                 double dt_s) {
  if (!hand_ || !under_) return Eigen::Vector3d::Zero();
  hand_->follow(position, orientation);
  if (before_ && dt_s > 0) {
    const double speed = under_->inwards.dot(hand_->position() - *before_) / dt_s;
    speed_ += (1 - std::exp(-dt_s / kSpeedOver)) * (speed - speed_);
  }
  before_ = hand_->position();
  return -press(*under_).force * under_->inwards;
}

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
  under_.reset();
  if (!on_skin) return false;
  under_ = {.position = on_skin->position, .inwards = on_skin->orientation * Eigen::Vector3d::UnitZ()};
  to.press = std::max(press(*under_).depth, -kHighest);
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
