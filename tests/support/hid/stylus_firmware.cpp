#include "tests/support/hid/stylus_firmware.h"

#include <algorithm>
#include <cerrno>

namespace stylet::support {

using namespace haptic::hid;

std::vector<std::uint8_t> StylusFirmware::descriptor() const {
  return {kForceStylusDescriptor.begin(), kForceStylusDescriptor.end()};
}

std::size_t StylusFirmware::input(std::int64_t now_ns, std::span<std::uint8_t> report) {
  if (first_report_ns_ < 0) first_report_ns_ = now_ns;
  last_report_ns_ = now_ns;
  now_ns_ = now_ns;
  const std::int64_t time_ns = now_ns - first_report_ns_;
  ForceStylusPose pose = motion_ ? motion_(static_cast<double>(time_ns) * 1e-9) : ForceStylusPose{};
  if (in_range_ && !pose.in_range) {
    force_.setZero();
    note(FirmwareEvent::kOutOfRange);
  }
  in_range_ = pose.in_range;
  pose.scan_time = static_cast<std::uint16_t>(time_ns / 100'000);
  pose.actuators_enabled = enabled_;
  pose.safety_switch = pose.actuator_power = true;
  const auto bytes = pack_pose(pose);
  std::copy(bytes.begin(), bytes.end(), report.begin());
  ++reports_;
  return bytes.size();
}

int StylusFirmware::output(std::int64_t now_ns, std::span<const std::uint8_t> report) {
  now_ns_ = now_ns;
  if (const std::optional<Eigen::Vector3d> force = unpack_force(report)) {
    force_ = in_range_ ? *force : Eigen::Vector3d(0, 0, 0);
    force_ns_ = now_ns;
    note(FirmwareEvent::kForce, *force);
    return 0;
  }
  if (report.size() != kControlReportBytes || report[0] != kControlReport) {
    note(FirmwareEvent::kRefused);
    return EINVAL;
  }
  switch (static_cast<ForceStylusControl>(report[1])) {
    case ForceStylusControl::kEnableActuators:
      if (!enabled_) force_.setZero();
      enabled_ = true;
      note(FirmwareEvent::kEnabled);
      return 0;
    case ForceStylusControl::kDisableActuators:
      enabled_ = false;
      force_.setZero();
      note(FirmwareEvent::kDisabled);
      return 0;
    case ForceStylusControl::kStopAll:
      force_.setZero();
      note(FirmwareEvent::kStopped);
      return 0;
    case ForceStylusControl::kReset:
      enabled_ = false;
      force_.setZero();
      gain_ = 255;
      note(FirmwareEvent::kReset);
      return 0;
  }
  note(FirmwareEvent::kRefused);
  return EINVAL;
}

int StylusFirmware::set_feature(std::int64_t /*now_ns*/, std::span<const std::uint8_t> report) {
  if (report.size() != kGainReportBytes || report[0] != kGainReport) return EINVAL;
  gain_ = report[1];
  return 0;
}

int StylusFirmware::get_feature(std::span<std::uint8_t> report) {
  if (report.size() < kGainReportBytes || report[0] != kGainReport) return -EINVAL;
  report[1] = gain_;
  return kGainReportBytes;
}

void StylusFirmware::tick(std::int64_t now_ns) {
  now_ns_ = now_ns;
  if (force_.isZero(0) || now_ns - force_ns_ < static_cast<std::int64_t>(kForceStylusForceTimeout * 1e9)) return;
  force_.setZero();
  note(FirmwareEvent::kTimeOut);
}

void StylusFirmware::power_off() {
  enabled_ = false;
  force_.setZero();
  note(FirmwareEvent::kPowerOff);
}

Eigen::Vector3d StylusFirmware::applied_force() const {
  return enabled_ ? (gain_ / 255.0 * force_).eval() : Eigen::Vector3d(0, 0, 0);
}

std::size_t StylusFirmware::count(FirmwareEvent::Kind kind) const {
  return static_cast<std::size_t>(
      std::count_if(events_.begin(), events_.end(), [&](const FirmwareEvent& event) { return event.kind == kind; }));
}

void StylusFirmware::note(FirmwareEvent::Kind kind, const Eigen::Vector3d& force) {
  events_.push_back({.kind = kind, .time_ns = now_ns_, .force = force});
}

}  // namespace stylet::support
