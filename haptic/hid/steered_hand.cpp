#include "haptic/hid/steered_hand.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic::hid {
namespace {

/// Share of the way to its goal that a first-order low-pass goes in a step.
double share(double dt_s, double smoothing_s) {
  return smoothing_s > 0 ? 1 - std::exp(-dt_s / smoothing_s) : 1.0;
}

}  // namespace

HandPose RateHand::step(const Eigen::Vector3d& velocity, const Eigen::Vector3d& angular_velocity, double dt_s) {
  const double towards = share(dt_s, steering_.smoothing_s);
  velocity_ += towards * (velocity - velocity_);
  rate_ += towards * (angular_velocity - rate_);
  for (int axis = 0; axis < 3; ++axis) {
    position_[axis] = std::clamp(position_[axis] + velocity_[axis] * dt_s, -steering_.reach_m, steering_.reach_m);
    rotation_[axis] = std::clamp(rotation_[axis] + rate_[axis] * dt_s, -steering_.reach_rad, steering_.reach_rad);
  }
  const double angle = rotation_.norm();
  return {.position = position_,
          .orientation = angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_ / angle))
                                   : Eigen::Quaterniond::Identity()};
}

HandPose PenHand::step(const Eigen::Vector2d& at, double push, double dt_s) {
  const double beyond = std::clamp((std::abs(push) - steering_.touch) / (1 - steering_.touch), 0.0, 1.0);
  depth_ = std::clamp(depth_ + steering_.full_speed_m_per_s * std::copysign(beyond, push) * dt_s,
                      steering_.min_depth_m, steering_.max_depth_m);
  const Eigen::Vector3d goal(at.x(), at.y(), depth_);
  if (!placed_) {
    placed_ = true;
    first_stage_ << at, second_stage_.z();
    second_stage_ = first_stage_;
  }
  const double towards = share(dt_s, steering_.smoothing_s);
  first_stage_ += towards * (goal - first_stage_);
  second_stage_ += towards * (first_stage_ - second_stage_);
  return {.position = second_stage_};
}

}  // namespace stylet::haptic::hid
