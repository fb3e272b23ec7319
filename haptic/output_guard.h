// The last gate before the motors: what may leave for the device, whatever the physics says.
#pragma once

#include "haptic/device.h"
#include "haptic/safety/force_gain.h"
#include "haptic/safety/motion_trip.h"
#include "haptic/safety/passivity_control.h"
#include "haptic/safety/thermal_limit.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>

namespace stylet::haptic {

enum OutputFlag : std::uint32_t {
  kOutputNonFinite = 1u << 0,    ///< the input was not finite: zero went out
  kOutputClamped = 1u << 1,      ///< the norm was limited to the device's peak
  kOutputRateLimited = 1u << 2,  ///< the change since the last sample was limited
  kOutputRising = 1u << 3,       ///< the force is still rising after engagement
  kOutputInvalid = 1u << 4,      ///< the stylus sample was not valid: zero went out
  kOutputDamped = 1u << 5,       ///< more energy came out than went in: damping was added
  kOutputHot = 1u << 6,          ///< the norm was limited because the motors are warm
  kOutputWaiting = 1u << 7,      ///< not engaged yet: zero went out
  kOutputStalePose = 1u << 8,    ///< the pose is old: the force fades, or is zero
  kOutputStalePatch = 1u << 9,   ///< the tissue patch is old: the force fades, or is zero
  kOutputTooFast = 1u << 10,     ///< the stylus was faster than a hand: zero went out
  kOutputJumped = 1u << 11,      ///< the pose jumped: zero went out
  kOutputTripped = 1u << 12,     ///< one of the two was not long ago: zero went out
  kOutputStalled = 1u << 13,     ///< the loop stood still so long that the device gave up: zero went out
};
inline constexpr int kOutputFlagCount = 14;
/// The device cannot give the force that is wanted.
inline constexpr std::uint32_t kOutputClipped = kOutputClamped | kOutputHot;

/// Of the flag 1u << `bit`, such as "non_finite".
const char* output_flag_name(int bit);

/// The wrench that is wanted, and what it was computed from.
struct GuardInput {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();     ///< N
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();    ///< N m
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the stylus that they answer to, m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  bool valid = false;      ///< of the stylus sample
  double pose_age_s = 0;   ///< of the pose that the wrench answers to
  double patch_age_s = 0;  ///< of the tissue patch
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
  std::array<std::uint64_t, kOutputFlagCount> flagged{};
  double clipped_s = 0;             ///< time with less than was wanted: kOutputClipped
  std::uint64_t clipped_times = 0;  ///< how often that began, half a second after the last
  std::uint64_t count(OutputFlag flag) const;
};

/// Limits the wrench by the data sheet of the device, in this order: what is not valid, not finite, or moved as no
/// hand moves is zero at once; passivity control; norm clamp; thermal limit; engagement, rise and fades; and last of
/// what shapes the force, because it is to bound what leaves, the rate limit. After a zero the force engages anew.
/// Whatever comes in, |force| <= max_force_n, |torque| <= max_torque_nm and, but for a drop to zero, |change| <=
/// max rate * dt. Depends on the sequence of its inputs only: no clock.
/// @realtime no allocation, O(1)
class OutputGuard {
public:
  /// @param period_s  of the calls of apply(), nominally
  explicit OutputGuard(const DeviceLimits& limits, double period_s = 1e-3);

  /// @param dt_s  since the last call; not positive or not finite counts as 0, which holds the force
  GuardedWrench apply(const GuardInput& input, double dt_s);

  const GuardCounters& counters() const { return counters_; }

private:
  static constexpr double kClippedApart = 0.5;  // s
  struct Motion {
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
    double turn_rad = 0;
    double dt_s = 0;  ///< 0: no new pose
  };
  Motion motion_since_last(const GuardInput& input, double dt_s);
  std::uint32_t reason_for_zero(const GuardInput& input, const Motion& motion, double dt_s);
  void shape(GuardedWrench& out, const GuardInput& input, const Motion& motion, double dt_s);
  bool limit_rate(GuardedWrench& out, double dt_s) const;
  void send(const GuardedWrench& out, double dt_s);

  DeviceLimits limits_;
  PassivityControl force_passivity_;
  PassivityControl torque_passivity_;
  ThermalLimit force_thermal_;
  ThermalLimit torque_thermal_;
  MotionTripwire tripwire_;
  ForceGain gain_;
  GuardCounters counters_;
  double unclipped_s_ = kClippedApart;  // since the force was clipped last
  GuardedWrench last_;
  GuardInput last_input_;  // of the last sample with a usable pose
  bool has_pose_ = false;
};

}  // namespace stylet::haptic
