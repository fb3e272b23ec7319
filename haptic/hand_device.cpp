#include "haptic/hand_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stylet::haptic {

HandDevice::HandDevice(const HandSettings& settings, DeviceLimits limits)
    : limits_(limits),
      smoothing_s_(settings.smoothing_s),
      map_({.start = settings.start, .start_orientation = settings.start_orientation}) {
  if (!settings.start.allFinite() || !settings.start_orientation.coeffs().allFinite())
    throw std::invalid_argument("hand: the start is not finite");
  if (!(settings.smoothing_s > 0)) throw std::invalid_argument("hand: the smoothing time must be positive");
  position_stages_.fill(map_.position());
  orientation_stages_.fill(map_.orientation());
  for (int i = 0; i < 3; ++i) goal_[i] = map_.position()[i];
  for (int i = 0; i < 4; ++i) goal_[3 + i] = map_.orientation().coeffs()[i];
}

void HandDevice::follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  if (!position.allFinite() || !orientation.coeffs().allFinite()) {
    release();
    return;
  }
  map_.follow(position, orientation.normalized());
  const Eigen::Vector4d now = map_.orientation().coeffs();
  double sign = 0;
  for (int i = 0; i < 4; ++i) sign += goal_[3 + i].load(std::memory_order_relaxed) * now[i];
  for (int i = 0; i < 3; ++i) goal_[i].store(map_.position()[i], std::memory_order_relaxed);
  for (int i = 0; i < 4; ++i) goal_[3 + i].store(sign < 0 ? -now[i] : now[i], std::memory_order_relaxed);
}

StylusSample HandDevice::read(double now_s) {
  Eigen::Vector3d position;
  Eigen::Quaterniond orientation;
  for (int i = 0; i < 3; ++i) position[i] = goal_[i].load(std::memory_order_relaxed);
  for (int i = 0; i < 4; ++i) orientation.coeffs()[i] = goal_[3 + i].load(std::memory_order_relaxed);
  orientation.normalize();
  // Two low-passes, each exact over the time since the last reading for a constant input.
  const double dt = read_before_ ? std::max(now_s - last_read_s_, 0.0) : 0.0;
  const double gain = 1 - std::exp(-dt / smoothing_s_);
  position_stages_[1] += gain * (position_stages_[0] - position_stages_[1]);
  position_stages_[0] += gain * (position - position_stages_[0]);
  orientation_stages_[1] = orientation_stages_[1].slerp(gain, orientation_stages_[0]).normalized();
  orientation_stages_[0] = orientation_stages_[0].slerp(gain, orientation).normalized();
  last_read_s_ = now_s;
  read_before_ = true;

  StylusSample out;
  out.time_s = now_s;
  out.position = position_stages_[1];
  out.orientation = orientation_stages_[1];
  out.buttons = buttons_.load(std::memory_order_relaxed);
  out.valid = true;
  return out;
}

}  // namespace stylet::haptic
