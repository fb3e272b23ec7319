#include "haptic/hid/force_stylus.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic::hid {
namespace {

constexpr double kPositionTick = 1e-7;  // m
constexpr double kMaxPosition = 10'000'000;
constexpr double kRotationTick = 1e-6;  // rad
constexpr double kMaxRotation = 3'141'593;
constexpr int kMaxForce = 32767;

void put32(std::span<std::uint8_t> bytes, double value, double limit) {
  const auto whole = static_cast<std::int32_t>(std::lround(std::clamp(value, -limit, limit)));
  for (int k = 0; k < 4; ++k) bytes[k] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(whole) >> (8 * k));
}

}  // namespace

// Written by hand, without the parser, so that each is a check on the other.
std::array<std::uint8_t, kPoseReportBytes> pack_pose(const ForceStylusPose& pose) {
  std::array<std::uint8_t, kPoseReportBytes> report{kPoseReport};
  const std::span<std::uint8_t> bytes(report);
  for (int axis = 0; axis < 3; ++axis) {
    put32(bytes.subspan(1 + 4 * axis), pose.position[axis] / kPositionTick, kMaxPosition);
    put32(bytes.subspan(13 + 4 * axis), pose.rotation_vector[axis] / kRotationTick, kMaxRotation);
  }
  report[25] = static_cast<std::uint8_t>(pose.scan_time);
  report[26] = static_cast<std::uint8_t>(pose.scan_time >> 8);
  const bool bits[] = {pose.barrel,        pose.secondary_barrel, pose.in_range, pose.actuators_enabled,
                       pose.safety_switch, pose.actuator_power};
  for (int k = 0; k < 6; ++k) report[27] = static_cast<std::uint8_t>(report[27] | (bits[k] ? 1 << k : 0));
  return report;
}

std::optional<Eigen::Vector3d> unpack_force(std::span<const std::uint8_t> report, double max_force_n) {
  if (report.size() != kForceReportBytes || report[0] != kForceReport) return {};
  Eigen::Vector3d force;
  for (int axis = 0; axis < 3; ++axis) {
    const auto raw = static_cast<std::int16_t>(report[1 + 2 * axis] | report[2 + 2 * axis] << 8);
    if (raw < -kMaxForce) return {};
    force[axis] = raw * max_force_n / kMaxForce;
  }
  return force;
}

}  // namespace stylet::haptic::hid
