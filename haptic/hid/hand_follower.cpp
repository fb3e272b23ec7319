#include "haptic/hid/hand_follower.h"

#include <algorithm>
#include <numbers>

namespace stylet::haptic::hid {
namespace {

constexpr double kLongestStep = 0.02;  // s; a loop that was kept away does not move the hub by all of it

/// Right, near and into the tablet from right, up and near.
Eigen::Quaterniond tablet_from_device() {
  return {std::numbers::sqrt2 / 2, -std::numbers::sqrt2 / 2, 0, 0};
}

/// Negative: drawing back.
double push_of(const HidReading& reading) {
  const bool back = (reading.buttons & (kBarrelButton | kEraserButton)) != 0;
  return back ? -reading.pressure : reading.pressure;
}

double seconds_between(std::int64_t then_ns, std::int64_t now_ns) {
  return static_cast<double>(now_ns - then_ns) * 1e-9;
}

}  // namespace

bool HandFollower::can_follow(const StreamedPose& pose, std::int64_t now_ns) const {
  if (!pose.connected || pose.gaps != gaps_) return false;
  const std::int64_t oldest_ns = std::min(pose.made_ns, pose.not_before_ns);
  if (settings_.stale_s > 0 && seconds_between(oldest_ns, now_ns) > settings_.stale_s) return false;
  if ((pose.reading.buttons & settings_.clutch) != 0) return false;
  if (settings_.kind == DeviceKind::kSpaceMouse) return true;
  if (!pose.reading.in_range) return false;
  return !waits_for_rest_ || (pose.reading.position - *settings_.workspace.rest).norm() <= kAtRest;
}

StylusSample HandFollower::follow(const StreamedPose& pose, std::int64_t now_ns) {
  const double dt_s = last_ns_ == 0 ? 0 : std::clamp(seconds_between(last_ns_, now_ns), 0.0, kLongestStep);
  last_ns_ = now_ns;
  const double age_s = std::max(0.0, seconds_between(pose.made_ns, now_ns));
  StylusSample sample{.buttons = pose.connected ? pose.reading.buttons : 0,
                      .valid = can_follow(pose, now_ns),
                      .age_s = settings_.stale_s > 0 ? age_s : 0};
  if (!sample.valid) {
    gaps_ = pose.gaps;
    map_.release();
    rate_.stop();
    pen_.lift();
  } else if (settings_.kind == DeviceKind::kSpaceMouse) {
    const HandPose hand = rate_.step(pose.reading.velocity, pose.reading.angular_velocity, dt_s);
    map_.follow(hand.position, hand.orientation);
  } else if (settings_.kind == DeviceKind::kPen) {
    const Eigen::Vector3d axis = map_.to_device(map_.orientation() * Eigen::Vector3d::UnitZ());
    const HandPose hand = pen_.step({.at = {pose.reading.position.x(), pose.reading.position.z()},
                                     .orientation = tablet_from_device() * pose.reading.orientation,
                                     .push = push_of(pose.reading),
                                     .along = axis / settings_.workspace.scale},
                                    dt_s);
    map_.follow(hand.position, hand.orientation);
  } else {
    map_.follow(pose.reading.position, pose.reading.orientation);
  }
  waits_for_rest_ = waits_for_rest_ && !sample.valid;
  sample.position = map_.position();
  sample.orientation = map_.orientation();
  return sample;
}

}  // namespace stylet::haptic::hid
