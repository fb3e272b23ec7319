#include "haptic/mouse_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stylet::haptic {

MouseDevice::MouseDevice(const MouseWorkspace& workspace, DeviceLimits limits)
    : workspace_(workspace), limits_(limits), depth_goal_(workspace.min_depth) {
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
  require(workspace.max_depth > workspace.min_depth && workspace.max_lateral >= 0, "a range is empty");
  require(workspace.smoothing_s > 0, "the smoothing time must be positive");
  up_ = workspace_.axis.cross(workspace_.right);
  Eigen::Matrix3d patient_from_needle;
  patient_from_needle << workspace_.right, up_, workspace_.axis;
  orientation_ = Eigen::Quaterniond(patient_from_needle).normalized();
  first_stage_ = second_stage_ = Eigen::Vector3d(0, 0, workspace_.min_depth);
}

void MouseDevice::move(double right_m, double up_m) {
  if (!std::isfinite(right_m) || !std::isfinite(up_m)) return;
  const double limit = workspace_.max_lateral;
  const auto shift = [limit](std::atomic<double>& goal, double by) {
    goal.store(std::clamp(goal.load(std::memory_order_relaxed) + by, -limit, limit), std::memory_order_relaxed);
  };
  shift(right_goal_, right_m);
  shift(up_goal_, up_m);
}

void MouseDevice::advance(double depth_m) {
  if (!std::isfinite(depth_m)) return;
  depth_goal_.store(
      std::clamp(depth_goal_.load(std::memory_order_relaxed) + depth_m, workspace_.min_depth, workspace_.max_depth),
      std::memory_order_relaxed);
}

StylusSample MouseDevice::read(double now_s) {
  const Eigen::Vector3d goal(right_goal_.load(std::memory_order_relaxed), up_goal_.load(std::memory_order_relaxed),
                             depth_goal_.load(std::memory_order_relaxed));
  // Two low-passes, each exact over the time since the last reading for a constant input.
  const double dt = read_before_ ? std::max(now_s - last_read_s_, 0.0) : 0.0;
  const double gain = 1 - std::exp(-dt / workspace_.smoothing_s);
  second_stage_ += gain * (first_stage_ - second_stage_);
  first_stage_ += gain * (goal - first_stage_);
  last_read_s_ = now_s;
  read_before_ = true;

  StylusSample out;
  out.time_s = now_s;
  out.position = workspace_.entry + workspace_.right * second_stage_[0] + up_ * second_stage_[1] +
                 workspace_.axis * (second_stage_[2] - workspace_.needle_length);
  out.orientation = orientation_;
  out.buttons = buttons_.load(std::memory_order_relaxed);
  out.valid = true;
  return out;
}

}  // namespace stylet::haptic
