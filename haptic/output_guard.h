// The last gate before the motors: what may leave for the device, whatever the physics says.
#pragma once

#include "haptic/device.h"

#include <Eigen/Core>

#include <cstdint>

namespace stylet::haptic {

enum OutputFlag : std::uint32_t {
  kOutputNonFinite = 1u << 0,    ///< the input was not finite: zero went out
  kOutputClamped = 1u << 1,      ///< the norm was limited
  kOutputRateLimited = 1u << 2,  ///< the change since the last sample was limited
  kOutputRamped = 1u << 3,       ///< the force is still rising after engagement
  kOutputInvalid = 1u << 4,      ///< the stylus sample was not valid: zero went out
};

/// What goes to the device.
struct GuardedWrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< N m
  std::uint32_t flags = 0;                           ///< OutputFlag bits of this sample
};

/// Samples so far, and how many of them had each flag.
struct GuardCounters {
  std::uint64_t samples = 0;
  std::uint64_t non_finite = 0;
  std::uint64_t clamped = 0;
  std::uint64_t rate_limited = 0;
  std::uint64_t invalid = 0;
};

struct GuardSettings {
  DeviceLimits limits;
  double ramp_s = 0.5;  ///< after engagement the gain rises from 0 to 1 in this time
  double max_torque_rate_nm_per_s = 50;
};

/// Applies, in this order: validity and finiteness (zero at once, and the ramp starts anew), norm clamp (direction
/// kept), ramp, rate limit (norm of the change, direction of the change kept). Whatever comes in,
/// |force| <= max_force_n, |torque| <= max_torque_nm and, but for a drop to zero, |change| <= max rate * dt.
/// Depends on the sequence of its inputs only: no clock.
/// @realtime no allocation, O(1)
class OutputGuard {
public:
  explicit OutputGuard(const GuardSettings& settings) : settings_(settings) {}

  /// @param force, torque  wanted, N and N m
  /// @param valid          of the stylus sample the force answers to
  /// @param dt_s           since the last call; not positive or not finite counts as 0
  GuardedWrench apply(const Eigen::Vector3d& force, const Eigen::Vector3d& torque, bool valid, double dt_s);

  const GuardCounters& counters() const { return counters_; }

private:
  GuardSettings settings_;
  GuardCounters counters_;
  Eigen::Vector3d last_force_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_torque_ = Eigen::Vector3d::Zero();
  double engaged_s_ = 0;
};

}  // namespace stylet::haptic
