#include "haptic/mouse_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stylet::haptic {

namespace {

constexpr double kMostTurns = 1e3;  // rad

void shift(std::atomic<double>& goal, double by, double limit) {
  if (!std::isfinite(by)) return;
  goal.store(std::clamp(goal.load(std::memory_order_relaxed) + by, -limit, limit), std::memory_order_relaxed);
}

}  // namespace

MouseDevice::MouseDevice(const MouseWorkspace& workspace, DeviceLimits limits)
    : workspace_(workspace), limits_(limits), depth_goal_(workspace.start_depth) {
  const auto require = [](bool ok, const char* what) {
    if (!ok) throw std::invalid_argument(std::string("mouse workspace: ") + what);
  };
  require(workspace.entry.allFinite() && workspace.axis.allFinite() && workspace.right.allFinite(),
          "a vector is not finite");
  require(workspace.axis.norm() > 1e-9, "the axis is zero");
  workspace_.axis.normalize();
  workspace_.right -= workspace_.axis * workspace_.axis.dot(workspace.right);
  require(workspace_.right.norm() > 1e-3 * workspace.right.norm() && workspace.right.norm() > 1e-9,
          "right is zero or along the axis");
  workspace_.right.normalize();
  require(workspace.max_depth > workspace.min_depth && workspace.max_lateral >= 0 && workspace.max_tilt >= 0,
          "a range is empty");
  require(workspace.start_depth >= workspace.min_depth && workspace.start_depth <= workspace.max_depth,
          "it starts out of its range");
  require(workspace.smoothing_s > 0, "the smoothing time must be positive");
  up_ = workspace_.axis.cross(workspace_.right);
  Eigen::Matrix3d patient_from_needle;
  patient_from_needle << workspace_.right, up_, workspace_.axis;
  orientation_ = Eigen::Quaterniond(patient_from_needle).normalized();
  first_stage_[2] = second_stage_[2] = workspace_.start_depth;
}

void MouseDevice::lead(const NeedleMove& by) {
  move(by.right_m, by.up_m);
  tilt(by.tilt_right_rad, by.tilt_up_rad);
  twist(by.twist_rad);
  advance(by.advance_m);
}

void MouseDevice::move(double right_m, double up_m) {
  shift(right_goal_, right_m, workspace_.max_lateral);
  shift(up_goal_, up_m, workspace_.max_lateral);
}

void MouseDevice::tilt(double right_rad, double up_rad) {
  shift(tilt_right_goal_, right_rad, workspace_.max_tilt);
  shift(tilt_up_goal_, up_rad, workspace_.max_tilt);
}

void MouseDevice::twist(double angle_rad) {
  shift(twist_goal_, angle_rad, kMostTurns);
}

void MouseDevice::advance(double depth_m) {
  if (!std::isfinite(depth_m)) return;
  depth_goal_.store(
      std::clamp(depth_goal_.load(std::memory_order_relaxed) + depth_m, workspace_.min_depth, workspace_.max_depth),
      std::memory_order_relaxed);
}

// Tilted about where the axis meets the skin: the hub, behind it, goes the other way than the axis.
Eigen::Quaterniond MouseDevice::tilted(double right_rad, double up_rad) const {
  return Eigen::Quaterniond(Eigen::AngleAxisd(-right_rad, up_) * Eigen::AngleAxisd(up_rad, workspace_.right));
}

NeedleMotion MouseDevice::motion() const {
  const double depth = depth_goal_.load(std::memory_order_relaxed);
  const double tilt_right = tilt_right_goal_.load(std::memory_order_relaxed);
  const double tilt_up = tilt_up_goal_.load(std::memory_order_relaxed);
  const Eigen::Vector3d pivot = workspace_.entry + workspace_.right * right_goal_.load(std::memory_order_relaxed) +
                                up_ * up_goal_.load(std::memory_order_relaxed);
  const Eigen::Vector3d axis = tilted(tilt_right, tilt_up) * workspace_.axis;
  const double to_hub = depth - workspace_.needle_length;  // from the pivot along the axis
  const Eigen::Vector3d by_tilt_up =
      tilted(tilt_right, 0) * workspace_.right.cross(tilted(0, tilt_up) * workspace_.axis);
  return {.hub = pivot + to_hub * axis,
          .middle = pivot + (depth - workspace_.needle_length / 2) * axis,
          .right = workspace_.right,
          .up = up_,
          .advance = axis,
          .tilt_right = to_hub * -up_.cross(axis),
          .tilt_up = to_hub * by_tilt_up};
}

StylusSample MouseDevice::read(double now_s) {
  const auto goal_of = [](const std::atomic<double>& goal) { return goal.load(std::memory_order_relaxed); };
  const Coordinates goal{goal_of(right_goal_),      goal_of(up_goal_),      goal_of(depth_goal_),
                         goal_of(tilt_right_goal_), goal_of(tilt_up_goal_), goal_of(twist_goal_)};
  // Two low-passes, each exact over the time since the last reading for a constant input.
  const double dt = read_before_ ? std::max(now_s - last_read_s_, 0.0) : 0.0;
  const double gain = 1 - std::exp(-dt / workspace_.smoothing_s);
  second_stage_ += gain * (first_stage_ - second_stage_);
  first_stage_ += gain * (goal - first_stage_);
  last_read_s_ = now_s;
  read_before_ = true;

  StylusSample out;
  out.time_s = now_s;
  const Eigen::Vector3d pivot = workspace_.entry + workspace_.right * second_stage_[0] + up_ * second_stage_[1];
  const Eigen::Quaterniond tilt = tilted(second_stage_[3], second_stage_[4]);
  const Eigen::Vector3d axis = tilt * workspace_.axis;
  out.position = pivot + axis * (second_stage_[2] - workspace_.needle_length);
  out.orientation = (tilt * Eigen::AngleAxisd(second_stage_[5], workspace_.axis) * orientation_).normalized();
  out.buttons = buttons_.load(std::memory_order_relaxed);
  out.valid = true;
  return out;
}

}  // namespace stylet::haptic
