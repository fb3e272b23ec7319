// The session's side of a device that sends the reports of a force stylus, turn by turn and without threads: what
// reads its reports, the hand, the guard, and the reports of forces.
#pragma once

#include "haptic/hid/force_output.h"
#include "haptic/hid/hand_follower.h"
#include "haptic/hid/pose_stream.h"
#include "haptic/output_guard.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace stylet::support {

class SessionSide {
public:
  using Send = std::function<void(std::span<const std::uint8_t>)>;

  explicit SessionSide(const std::vector<std::uint8_t>& descriptor)
      : descriptor_(haptic::hid::parse_report_descriptor(descriptor)) {
    limits_ = output_.limits();
    limits_.renders_force = true;
    limits_.engage_force_n = 1.5;  // so that the force is back between two faults
    limits_.engage_rise_s = 0.05;
    guard_.emplace(limits_);
    connect();
  }

  void connect() {
    stream_ = std::make_unique<haptic::hid::PoseStream>(map_, counters_, limits_.stale_pose_zero_s, gaps_);
  }
  void disconnect() { pose_ = {.gaps = ++gaps_}; }

  bool starved = false;  ///< the reader is kept away
  bool loop_stops = false;
  bool not_finite = false;  ///< what physics says

  void enable(const Send& send) {
    std::array<std::uint8_t, 16> bytes{};
    const std::size_t size = output_.encode(haptic::hid::DeviceControl::kEnableActuators, bytes);
    send(std::span(bytes).first(size));
  }
  void report(std::span<const std::uint8_t> bytes) { queue_.emplace_back(bytes.begin(), bytes.end()); }
  /// A step of reader, loop and writer.
  void step(std::int64_t now_ns, const Send& send) {
    if (!starved) {
      for (const auto& bytes : queue_) stream_->add(bytes, now_ns);
      queue_.clear();
      if (stream_->end(now_ns)) {
        pose_ = stream_->latest();
        gaps_ = pose_.gaps;
      }
    }
    if (!loop_stops) loop(now_ns);
    if (now_ns - ordered_ns_ >= 20'000'000) return;  // ForceWriter's zero would come here; nothing comes at all
    std::array<std::uint8_t, 64> bytes{};
    const std::size_t size = output_.encode(0, to_write_, Eigen::Vector3d::Zero(), bytes);
    if (!loop_stops) send(std::span(bytes).first(size));
  }
  std::uint64_t engagements() const { return engagements_; }
  const haptic::DeviceLimits& limits() const { return limits_; }

private:
  void loop(std::int64_t now_ns) {
    const double dt_s = last_ns_ == 0 ? 1e-3 : static_cast<double>(now_ns - last_ns_) * 1e-9;
    last_ns_ = now_ns;
    const haptic::StylusSample sample = follower_.follow(pose_, now_ns);
    haptic::GuardInput input{.force = Eigen::Vector3d(0.3, 0, 1) - 100 * sample.position,
                             .position = sample.position,
                             .orientation = sample.orientation,
                             .valid = sample.valid,
                             .pose_age_s = sample.age_s};
    if (not_finite) input.force.x() = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Vector3d force = guard_->apply(input, dt_s).force;
    if (sent_.isZero(0) && !force.isZero(0)) ++engagements_;
    sent_ = force;
    to_write_ = follower_.map().to_device(force);
    ordered_ns_ = now_ns;
  }

  haptic::hid::ReportDescriptor descriptor_;
  haptic::hid::StylusMap map_{descriptor_, haptic::hid::DeviceProfile{}};
  haptic::hid::ForceOutput output_{descriptor_, haptic::hid::DeviceProfile{.limits = haptic::DeviceLimits{}}};
  haptic::DeviceLimits limits_;
  haptic::hid::StreamCounters counters_;
  std::unique_ptr<haptic::hid::PoseStream> stream_;
  haptic::hid::HandFollower follower_{haptic::hid::FollowSettings{}};
  std::optional<haptic::OutputGuard> guard_;
  std::vector<std::vector<std::uint8_t>> queue_;
  haptic::hid::StreamedPose pose_;
  std::uint64_t gaps_ = 0;
  std::int64_t last_ns_ = 0;
  std::int64_t ordered_ns_ = 0;
  Eigen::Vector3d sent_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_write_ = Eigen::Vector3d::Zero();
  std::uint64_t engagements_ = 0;
};

}  // namespace stylet::support
