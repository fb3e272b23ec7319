// The force stylus of haptic/README.md as its maker would program it.
#pragma once

#include "haptic/hid/force_stylus.h"
#include "tests/support/hid/mock_firmware.h"

#include <Eigen/Core>

#include <functional>

namespace stylet::support {

/// What the device did, and when (CLOCK_MONOTONIC, ns).
struct FirmwareEvent {
  enum Kind { kForce, kTimeOut, kEnabled, kDisabled, kStopped, kReset, kRefused, kPowerOff, kOutOfRange };
  Kind kind = kForce;
  std::int64_t time_ns = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< asked for, of kForce; N, along the axes of the reports
};

/// Depends on the calls and their times only.
class StylusFirmware final : public MockFirmware {
public:
  using Motion = std::function<haptic::hid::ForceStylusPose(double time_s)>;

  /// @param motion  of the hand, time since the first report; none: it rests in the middle
  explicit StylusFirmware(Motion motion = {}) : motion_(std::move(motion)) {}

  std::vector<std::uint8_t> descriptor() const override;
  std::size_t input(std::int64_t now_ns, std::span<std::uint8_t> report) override;
  int output(std::int64_t now_ns, std::span<const std::uint8_t> report) override;
  int set_feature(std::int64_t now_ns, std::span<const std::uint8_t> report) override;
  int get_feature(std::span<std::uint8_t> report) override;
  /// The force is dropped when the host has said nothing for the time-out.
  void tick(std::int64_t now_ns) override;
  void power_off() override;

  /// What the motors give: zero unless they are enabled, the handle is in range and a force came in time; times the
  /// gain. N, along the axes of the reports
  Eigen::Vector3d applied_force() const;
  bool enabled() const { return enabled_; }
  std::uint8_t gain() const { return gain_; }
  std::uint64_t reports() const { return reports_; }
  std::int64_t last_report_ns() const { return last_report_ns_; }
  const std::vector<FirmwareEvent>& events() const { return events_; }
  std::size_t count(FirmwareEvent::Kind kind) const;

private:
  void note(FirmwareEvent::Kind kind, const Eigen::Vector3d& force = Eigen::Vector3d::Zero());

  Motion motion_;
  std::vector<FirmwareEvent> events_;
  std::int64_t now_ns_ = 0;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
  std::int64_t force_ns_ = 0;
  std::int64_t first_report_ns_ = -1;
  std::int64_t last_report_ns_ = 0;
  std::uint64_t reports_ = 0;
  bool enabled_ = false;
  bool in_range_ = true;
  std::uint8_t gain_ = 255;
};

}  // namespace stylet::support
