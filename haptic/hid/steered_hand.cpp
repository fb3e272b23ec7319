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

HandPose PenHand::step(const PenInput& pen, double dt_s) {
  const double beyond = std::clamp((std::abs(pen.push) - steering_.touch) / (1 - steering_.touch), 0.0, 1.0);
  const double depth = std::clamp(depth_ + steering_.full_speed_m_per_s * std::copysign(beyond, pen.push) * dt_s,
                                  steering_.min_depth_m, steering_.max_depth_m);
  goal_ = {.at = pen.at, .orientation = pen.orientation, .advance = goal_.advance + (depth - depth_) * pen.along};
  depth_ = depth;
  if (!placed_) {
    placed_ = true;
    first_stage_ = {.at = pen.at, .orientation = pen.orientation, .advance = second_stage_.advance};
    second_stage_ = first_stage_;
  }
  const double towards = share(dt_s, steering_.smoothing_s);
  approach(first_stage_, goal_, towards);
  approach(second_stage_, first_stage_, towards);
  const Stage& now = second_stage_;
  return {.position = Eigen::Vector3d(now.at.x(), now.at.y(), 0) + now.advance, .orientation = now.orientation};
}

void PenHand::approach(Stage& stage, const Stage& goal, double share) {
  stage.at += share * (goal.at - stage.at);
  stage.orientation = stage.orientation.slerp(share, goal.orientation);
  stage.advance += share * (goal.advance - stage.advance);
}

}  // namespace stylet::haptic::hid
