#include "haptic/hid/stylus_adapter.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic::hid {
namespace {

constexpr double kFarthest = 1;              // m, an axis: the range of report 1
constexpr double kMostOffNorm = 0.01;        // of a quaternion
constexpr std::int64_t kScanTick = 100'000;  // ns
constexpr auto kTimeOut = static_cast<std::int64_t>(kForceStylusForceTimeout * 1e9);

bool sound(const AdaptedState& state) {
  return state.position.allFinite() && state.position.cwiseAbs().maxCoeff() <= kFarthest &&
         std::abs(state.orientation.coeffs().norm() - 1) < kMostOffNorm;  // false of what is not finite
}

}  // namespace

std::vector<std::uint8_t> adapted_descriptor(double max_force_n) {
  std::vector<std::uint8_t> bytes(kForceStylusDescriptor.begin(), kForceStylusDescriptor.end());
  const auto most = static_cast<std::int16_t>(std::lround(std::clamp(max_force_n * 1e3, 1.0, 32767.0)));
  // Physical Minimum and Maximum of report 2, the only ones of 16 bits and not zero.
  constexpr std::array<std::uint8_t, 6> kPhysical{0x36, 0x1C, 0xF3, 0x46, 0xE4, 0x0C};
  const auto at = std::search(bytes.begin(), bytes.end(), kPhysical.begin(), kPhysical.end());
  const auto put = [](auto where, int value) {
    where[0] = static_cast<std::uint8_t>(value & 0xFF);
    where[1] = static_cast<std::uint8_t>(value >> 8 & 0xFF);
  };
  put(at + 1, -most);
  put(at + 4, most);
  return bytes;
}

std::array<std::uint8_t, kPoseReportBytes> StylusAdapter::input(const AdaptedState& state, std::int64_t now_ns) {
  if (first_ns_ < 0) first_ns_ = now_ns;
  const bool whole = sound(state);
  in_range_ = whole && state.in_range;
  if (!in_range_) interrupt();
  ForceStylusPose pose{.scan_time = static_cast<std::uint16_t>((now_ns - first_ns_) / kScanTick),
                       .barrel = state.barrel,
                       .secondary_barrel = state.secondary_barrel,
                       .in_range = in_range_,
                       .actuators_enabled = enabled_ && state.enabled,
                       .safety_switch = state.enabled,
                       .actuator_power = state.power};
  if (whole) {
    const Eigen::AngleAxisd turn(state.orientation.normalized());
    pose.position = state.position;
    pose.rotation_vector = turn.axis() * turn.angle();  // AngleAxis gives angles up to pi
  }
  return pack_pose(pose);
}

bool StylusAdapter::output(std::span<const std::uint8_t> report, std::int64_t now_ns) {
  if (const auto force = unpack_force(report, max_force_n_)) {
    if (now_ns - force_ns_ >= kTimeOut) interrupt();
    force_.setZero();
    if (!enabled_ || !in_range_) return true;
    const double norm = force->norm();
    force_ = norm > max_force_n_ ? (*force * (max_force_n_ / norm)).eval() : *force;
    force_ns_ = now_ns;
    if (dropped_ && !force_.isZero(0)) {
      dropped_ = false;
      rise_ns_ = now_ns;
    }
    return true;
  }
  if (report.size() == kForceReportBytes && report[0] == kForceReport) {  // outside its range: no force
    interrupt();
    return true;
  }
  if (report.size() != kControlReportBytes || report[0] != kControlReport) return false;
  switch (static_cast<ForceStylusControl>(report[1])) {
    case ForceStylusControl::kEnableActuators:
      if (!enabled_) interrupt();
      enabled_ = true;
      return true;
    case ForceStylusControl::kDisableActuators:
      enabled_ = false;
      interrupt();
      return true;
    case ForceStylusControl::kStopAll:
      interrupt();
      return true;
    case ForceStylusControl::kReset:
      reset();
      return true;
  }
  return false;
}

bool StylusAdapter::set_gain(std::span<const std::uint8_t> report) {
  if (report.size() != kGainReportBytes || report[0] != kGainReport) return false;
  gain_ = report[1];
  return true;
}

Eigen::Vector3d StylusAdapter::force(std::int64_t now_ns) const {
  if (!enabled_ || !in_range_ || now_ns - force_ns_ >= kTimeOut || now_ns < force_ns_) return {0, 0, 0};
  const double risen = std::min(1.0, static_cast<double>(now_ns - rise_ns_) / static_cast<double>(kRise));
  return risen * gain_ / 255.0 * force_;
}

void StylusAdapter::reset() {
  enabled_ = false;
  gain_ = 255;
  interrupt();
}

void StylusAdapter::interrupt() {
  force_.setZero();
  dropped_ = true;
}

}  // namespace stylet::haptic::hid
