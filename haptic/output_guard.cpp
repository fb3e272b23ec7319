#include "haptic/output_guard.h"

#include "haptic/safety/vector_limits.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace stylet::haptic {
namespace {

constexpr double kLongestStep = 0.005;  // s; a late step may not change the force more than this much of a rise
constexpr double kShortestStep = 1e-4;  // s; between two poses: what is less is jitter of their time stamps
constexpr double kFutureAge = -1e-3;    // s; an age below says that a clock was set
constexpr double kPassivityShare =
    0.5;                         // of the damping that is stable: the spring at the needle's base has the rest
constexpr double kLever = 0.05;  // m; passivity of rotations: a grip of this radius has the speeds above

bool usable(const GuardInput& input) {
  return input.valid && input.position.allFinite() && input.orientation.coeffs().allFinite() &&
         input.pose_age_s > kFutureAge;
}

/// Rotation vector of a small turn.
Eigen::Vector3d small_turn(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  const Eigen::Quaterniond turn = to * from.conjugate();
  return std::copysign(2.0, turn.w()) * turn.vec();
}

PassivitySettings of_force(const DeviceLimits& limits) {
  return {.max_damping = kPassivityShare * limits.max_damping_n_s_per_m,
          .own_damping = limits.physical_damping_n_s_per_m,
          .delay_s = limits.loop_delay_s};
}

PassivitySettings of_torque(const DeviceLimits& limits) {
  const PassivitySettings force;
  return {.max_damping = kPassivityShare * limits.max_rotational_damping_nm_s_per_rad,
          .delay_s = limits.loop_delay_s,
          .min_speed = force.min_speed / kLever,
          .softest = force.softest * kLever * kLever};
}

}  // namespace

const char* output_flag_name(int bit) {
  static constexpr std::array<const char*, kOutputFlagCount> kNames{
      "non_finite", "clamped",    "rate_limited", "rising",   "invalid", "damped",  "hot",
      "waiting",    "stale_pose", "stale_patch",  "too_fast", "jumped",  "tripped", "stalled"};
  return kNames[bit];
}

std::uint64_t GuardCounters::count(OutputFlag flag) const {
  return flagged[std::countr_zero(static_cast<std::uint32_t>(flag))];
}

OutputGuard::OutputGuard(const DeviceLimits& limits, double period_s)
    : limits_(limits),
      force_passivity_(of_force(limits), period_s),
      torque_passivity_(of_torque(limits), period_s),
      force_thermal_(limits.max_force_n, limits.continuous_force_n, limits.thermal_time_constant_s),
      torque_thermal_(limits.max_torque_nm, limits.continuous_torque_nm, limits.thermal_time_constant_s),
      tripwire_({.max_speed_m_per_s = limits.max_speed_m_per_s,
                 .max_jump_m = limits.max_position_jump_m,
                 .max_turn_rad = limits.max_rotation_jump_rad}),
      gain_({.rise_s = limits.engage_rise_s,
             .engage_share = limits.engage_force_n / limits.max_force_n,
             .pose_fade_s = limits.stale_pose_fade_s,
             .pose_zero_s = limits.stale_pose_zero_s,
             .patch_fade_s = limits.stale_patch_fade_s,
             .patch_zero_s = limits.stale_patch_zero_s}) {}

GuardedWrench OutputGuard::apply(const GuardInput& input, double dt_s) {
  const double dt = std::isfinite(dt_s) ? std::max(dt_s, 0.0) : 0.0;
  const Motion motion = motion_since_last(input, dt);
  GuardedWrench out;
  out.flags = reason_for_zero(input, motion, dt);
  if (out.flags == 0) shape(out, input, motion, dt);
  send(out, dt);
  return out;
}

// Divided by the time between the poses, not between the calls, so that a late report is no slow motion and the next
// one no fast one.
OutputGuard::Motion OutputGuard::motion_since_last(const GuardInput& input, double dt_s) {
  Motion motion;
  if (!usable(input)) {
    has_pose_ = false;
    tripwire_.rest();
    return motion;
  }
  if (has_pose_) {
    motion.translation = input.position - last_input_.position;
    motion.rotation = small_turn(last_input_.orientation, input.orientation);
    motion.turn_rad = last_input_.orientation.angularDistance(input.orientation);
    const bool moved = !motion.translation.isZero(0) || !motion.rotation.isZero(0);
    const double between = dt_s + last_input_.pose_age_s - input.pose_age_s;
    if (moved || between > kShortestStep) motion.dt_s = std::max(between, kShortestStep);
  }
  last_input_ = input;
  has_pose_ = true;
  return motion;
}

std::uint32_t OutputGuard::reason_for_zero(const GuardInput& input, const Motion& motion, double dt_s) {
  std::uint32_t flags = 0;
  if (!has_pose_) flags |= kOutputInvalid;
  if (!input.force.allFinite() || !input.torque.allFinite()) flags |= kOutputNonFinite;
  if (dt_s >= limits_.stale_pose_zero_s) flags |= kOutputStalled;
  if (motion.dt_s <= 0) return tripwire_.tripped() ? flags | kOutputTripped : flags;
  switch (tripwire_.step(motion.translation, motion.turn_rad, motion.dt_s)) {
    case MotionTrip::none:
      return flags;
    case MotionTrip::speed:
      return flags | kOutputTooFast;
    case MotionTrip::jump:
      return flags | kOutputJumped;
    case MotionTrip::waiting:
      return flags | kOutputTripped;
  }
  return flags;
}

void OutputGuard::shape(GuardedWrench& out, const GuardInput& input, const Motion& motion, double dt_s) {
  out.force = input.force;
  out.torque = input.torque;
  if (motion.dt_s > 0) {
    const bool force_damped = force_passivity_.step(out.force, motion.translation, motion.dt_s);
    const bool torque_damped = torque_passivity_.step(out.torque, motion.rotation, motion.dt_s);
    if (force_damped || (torque_damped && limits_.max_torque_nm > 0)) out.flags |= kOutputDamped;
  }

  const bool force_clamped = clamp_norm(out.force, limits_.max_force_n);
  // A device without torque output is no reason for a flag at every sample.
  const bool torque_clamped = clamp_norm(out.torque, limits_.max_torque_nm) && limits_.max_torque_nm > 0;
  if (force_clamped || torque_clamped) out.flags |= kOutputClamped;

  const bool force_hot = clamp_norm(out.force, force_thermal_.limit());
  const bool torque_hot = clamp_norm(out.torque, torque_thermal_.limit());
  const bool below_peak =
      force_thermal_.limit() < limits_.max_force_n || torque_thermal_.limit() < limits_.max_torque_nm;
  if ((force_hot || torque_hot) && below_peak) out.flags |= kOutputHot;

  const double step_s = std::min(dt_s, kLongestStep);
  const double torque_share = limits_.max_torque_nm > 0 ? out.torque.norm() / limits_.max_torque_nm : 0;
  const double gain = gain_.step(std::max(out.force.norm() / limits_.max_force_n, torque_share), input.pose_age_s,
                                 input.patch_age_s, step_s);
  if (!(input.pose_age_s <= limits_.stale_pose_fade_s)) out.flags |= kOutputStalePose;
  if (!(input.patch_age_s <= limits_.stale_patch_fade_s)) out.flags |= kOutputStalePatch;
  if (gain < 1 && (out.flags & (kOutputStalePose | kOutputStalePatch)) == 0) {
    out.flags |= gain_.engaged() ? kOutputRising : kOutputWaiting;
  }
  out.force *= gain;
  out.torque *= gain;
  if (gain > 0 && limit_rate(out, step_s)) out.flags |= kOutputRateLimited;
}

bool OutputGuard::limit_rate(GuardedWrench& out, double dt_s) const {
  const bool force = limit_change(out.force, last_.force, limits_.max_force_rate_n_per_s * dt_s);
  const bool torque = limit_change(out.torque, last_.torque, limits_.max_torque_rate_nm_per_s * dt_s);
  return force || torque;
}

void OutputGuard::send(const GuardedWrench& out, double dt_s) {
  constexpr std::uint32_t kZeroAtOnce =
      kOutputNonFinite | kOutputInvalid | kOutputTooFast | kOutputJumped | kOutputTripped | kOutputStalled;
  if ((out.flags & kZeroAtOnce) != 0) {
    gain_.drop();
    force_passivity_.reset();
    torque_passivity_.reset();
  }
  // What went out last was held until now.
  force_thermal_.held(last_.force.norm(), dt_s);
  torque_thermal_.held(last_.torque.norm(), dt_s);
  force_passivity_.sent(out.force);
  torque_passivity_.sent(out.torque);
  last_ = out;
  ++counters_.samples;
  if ((out.flags & kOutputClipped) != 0) {
    counters_.clipped_s += dt_s;
    if (unclipped_s_ >= kClippedApart) ++counters_.clipped_times;
    unclipped_s_ = 0;
  } else {
    unclipped_s_ += dt_s;
  }
  for (int bit = 0; bit < kOutputFlagCount; ++bit) {
    counters_.flagged[bit] += (out.flags >> bit) & 1u;
  }
}

}  // namespace stylet::haptic
