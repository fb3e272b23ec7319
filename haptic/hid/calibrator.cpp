#include "haptic/hid/calibrator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::haptic::hid {
namespace {

constexpr double kPushed = 0.3;          // of the full deflection: no noise
constexpr double kNoiseMargin = 1.5;     // dead zone over what was seen at rest
constexpr double kLeastDeadZone = 0.02;  // of the full deflection: a second does not show all the noise
constexpr double kSquareness = 25;       // degrees that the corner of a hand's rectangle may be off
constexpr double kParallel = 0.4;        // of the shorter side, that opposite sides may differ by
constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

Calibrator::Calibrator(DeviceKind kind, const CalibratorSettings& settings) : kind_(kind), settings_(settings) {
  using enum Step;
  switch (kind) {
    case DeviceKind::kStylus:
      steps_ = {kRest, kNearLeft, kNearRight, kFarRight, kFarLeft};
      break;
    case DeviceKind::kPen:
      steps_ = {kNearLeft, kNearRight, kFarRight, kFarLeft};
      break;
    case DeviceKind::kJoystick:
      steps_ = {kRest};
      break;
    case DeviceKind::kSpaceMouse:
      steps_ = {kPush, kRelease};
      break;
    case DeviceKind::kUnusable:
      break;
  }
}

std::string Calibrator::prompt() const {
  if (done()) return {};
  switch (steps_[next_]) {
    case Step::kRest:
      return kind_ == DeviceKind::kJoystick ? "Let go of the stick."
                                            : "Hold the stylus still where a session shall begin: its rest place.";
    case Step::kNearLeft:
      return "Hold it still at the corner of your reach that is near and left.";
    case Step::kNearRight:
      return "Now near and right, at the same height.";
    case Step::kFarRight:
      return "Now far and right.";
    case Step::kFarLeft:
      return "Now far and left.";
    case Step::kPush:
      return "Push the cap firmly, any way.";
    case Step::kRelease:
      return "Let go of the cap, and of the desk.";
  }
  return {};
}

bool Calibrator::usable(const HidReading& reading) const {
  return kind_ == DeviceKind::kSpaceMouse || reading.in_range;
}

bool Calibrator::is_new_place(const Eigen::Vector3d& place) const {
  return std::ranges::all_of(
      places_, [&](const Eigen::Vector3d& other) { return (place - other).norm() >= settings_.apart_m; });
}

void Calibrator::restart(const Values& values, double time_s) {
  started_ = true;
  since_s_ = time_s;
  lowest_ = highest_ = values;
}

bool Calibrator::add(const HidReading& reading, double time_s) {
  if (done()) return false;
  if (!usable(reading)) {
    started_ = false;
    return false;
  }
  const bool springs = kind_ == DeviceKind::kSpaceMouse;
  Values values = Values::Zero();
  if (springs) {
    values = Eigen::Map<const Values>(reading.axes.data());
  } else {
    values.head<3>() = reading.position;
  }
  if (steps_[next_] == Step::kPush) {
    if (values.cwiseAbs().maxCoeff() < kPushed) return false;
    ++next_;
    started_ = false;
    return true;
  }
  if (!started_) restart(values, time_s);
  lowest_ = lowest_.cwiseMin(values);
  highest_ = highest_.cwiseMax(values);
  const Values stray = highest_ - lowest_;
  const Values middle = 0.5 * (highest_ + lowest_);
  const bool moved = springs ? stray.maxCoeff() > settings_.still_share || middle.cwiseAbs().maxCoeff() > kPushed / 2
                             : stray.norm() > settings_.still_m || !is_new_place(middle.head<3>());
  if (moved) {
    restart(values, time_s);
    return false;
  }
  if (time_s - since_s_ < settings_.still_s) return false;
  if (!springs) places_.emplace_back(middle.head<3>());
  ++next_;
  if (!done()) started_ = false;
  return true;
}

const Eigen::Vector3d& Calibrator::place(Step step) const {
  return places_[std::ranges::find(steps_, step) - steps_.begin()];
}

/// Right and near are the mean directions of the sides; up is across both.
void Calibrator::align(Calibration& found) const {
  const Eigen::Vector3d near_left = place(Step::kNearLeft), near_right = place(Step::kNearRight);
  const Eigen::Vector3d far_left = place(Step::kFarLeft), far_right = place(Step::kFarRight);
  const Eigen::Vector3d right = 0.5 * (near_right - near_left + far_right - far_left);
  const Eigen::Vector3d near = 0.5 * (near_left - far_left + near_right - far_right);
  const double shorter = std::min(right.norm(), near.norm());
  const double apart = (near_right - near_left - (far_right - far_left)).norm();
  const double lean = std::abs(right.dot(near)) / std::max(right.norm() * near.norm(), 1e-12);
  if (!(shorter >= settings_.apart_m / 2) || lean > std::sin(kSquareness * kDegree) || apart > kParallel * shorter) {
    throw CalibrationError("the four places are no rectangle; begin anew, at one height, corner by corner");
  }
  Eigen::Matrix3d device_from_user;
  device_from_user.col(0) = right.normalized();
  device_from_user.col(2) = (near - near.dot(device_from_user.col(0)) * device_from_user.col(0)).normalized();
  device_from_user.col(1) = device_from_user.col(2).cross(device_from_user.col(0));
  if (device_from_user(1, 1) < 0) {
    throw CalibrationError(
        "the corners go round the other way: left and right, or near and far, changed places; begin anew");
  }
  found.user_from_device = Eigen::Quaterniond(device_from_user).conjugate();
  found.scale = std::clamp(settings_.span_m / shorter, 1.0, settings_.most_scale);
}

Calibration Calibrator::result() const {
  Calibration found;
  if (kind_ == DeviceKind::kSpaceMouse) {
    found.centre.emplace();
    found.dead_zone.emplace();
    for (int axis = 0; axis < 6; ++axis) {
      (*found.centre)[axis] = 0.5 * (lowest_[axis] + highest_[axis]);
      (*found.dead_zone)[axis] = std::max(kLeastDeadZone, kNoiseMargin * 0.5 * (highest_[axis] - lowest_[axis]));
    }
    return found;
  }
  if (kind_ != DeviceKind::kPen) found.rest = place(Step::kRest);
  if (kind_ != DeviceKind::kJoystick) align(found);
  return found;
}

}  // namespace stylet::haptic::hid
