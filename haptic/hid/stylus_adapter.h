// A device that knows no HID made to speak the reports of the force stylus (haptic/README.md).
#pragma once

#include "haptic/hid/force_stylus.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace stylet::haptic::hid {

/// What such a device says of itself, in the axes of the reports: X right, Y towards the user, Z down.
struct AdaptedState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< from where the device calls it none
  bool barrel = false;
  bool secondary_barrel = false;
  bool in_range = false;                        ///< false: the pose means nothing
  bool enabled = false;                         ///< the device takes forces
  bool power = false;                           ///< its motors have their supply
  std::optional<Eigen::Vector3d> told_force{};  ///< that it says its motors give, N; none: it says nothing of it
};

/// The descriptor of the force stylus with another largest force.
/// @param max_force_n  0.001 to 32.767 N, an axis
std::vector<std::uint8_t> adapted_descriptor(double max_force_n);

/// Keeps the rules of the specification where the device itself knows none: no force before Enable Actuators and a
/// report 2 after it, none kForceStylusForceTimeout after the last report 2, none while the pose means nothing, none
/// beyond the largest. What comes back after such a time rises over kRise: the session may not have seen it. Whoever
/// drives the device asks for force() before each command that he sends to it. Depends on its inputs only; one thread
/// at a time.
class StylusAdapter {
public:
  static constexpr std::int64_t kRise = 50'000'000;  ///< ns

  /// @param max_force_n  norm, and the range of report 2
  explicit StylusAdapter(double max_force_n) : max_force_n_(max_force_n) {}

  /// What the device said. A pose that is not finite, is outside the range of report 1 (1 m) or whose quaternion is
  /// off by more than 1 % is none: the state is out of range.
  /// @return report 1. @param now_ns  monotonic clock, when it came
  std::array<std::uint8_t, kPoseReportBytes> input(const AdaptedState& state, std::int64_t now_ns);
  /// Reports 2 and 3; a report 2 outside its range is no force at once. @return false: it is neither
  bool output(std::span<const std::uint8_t> report, std::int64_t now_ns);
  /// Report 4. @return false: it is not that
  bool set_gain(std::span<const std::uint8_t> report);
  std::uint8_t gain() const { return gain_; }
  /// Whether the session wants the motors on.
  bool enabled() const { return enabled_; }
  /// What the device is to push with now, axes of the reports, N.
  Eigen::Vector3d force(std::int64_t now_ns) const;
  /// The device could not be told a force: what comes next rises anew.
  void interrupt();
  /// As before the first report: actuators disabled, no force.
  void reset();

private:
  double max_force_n_;
  std::int64_t first_ns_ = -1;
  std::int64_t force_ns_ = 0;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
  bool enabled_ = false;
  bool in_range_ = false;
  bool dropped_ = true;       // there was no force before the next one
  std::int64_t rise_ns_ = 0;  // since when it rises
  std::uint8_t gain_ = 255;
};

}  // namespace stylet::haptic::hid
