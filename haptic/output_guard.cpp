#include "haptic/output_guard.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic {
namespace {

/// Scales `v` to norm `max` if it is longer. Divides by the largest component first: the norm of a finite vector may
/// overflow.
bool clamp_norm(Eigen::Vector3d& v, double max) {
  const double largest = v.cwiseAbs().maxCoeff();
  if (largest == 0) return false;
  const Eigen::Vector3d unit_box = v / largest;
  const double scale = max / unit_box.norm();  // of the vector with its largest component 1
  if (largest <= scale) return false;
  v = unit_box * scale;
  return true;
}

/// Moves from `last` towards `wanted` by at most `max_change`. Both ends lie in a ball, so the result does too.
bool limit_change(Eigen::Vector3d& wanted, const Eigen::Vector3d& last, double max_change) {
  Eigen::Vector3d change = wanted - last;
  if (!clamp_norm(change, max_change)) return false;
  wanted = last + change;
  return true;
}

}  // namespace

GuardedWrench OutputGuard::apply(const Eigen::Vector3d& force, const Eigen::Vector3d& torque, bool valid,
                                 double dt_s) {
  GuardedWrench out;
  ++counters_.samples;
  const double dt = std::isfinite(dt_s) ? std::max(dt_s, 0.0) : 0.0;

  if (!valid) out.flags |= kOutputInvalid;
  if (!force.allFinite() || !torque.allFinite()) out.flags |= kOutputNonFinite;
  if (out.flags != 0) {
    counters_.invalid += (out.flags & kOutputInvalid) != 0 ? 1 : 0;
    counters_.non_finite += (out.flags & kOutputNonFinite) != 0 ? 1 : 0;
    last_force_.setZero();
    last_torque_.setZero();
    engaged_s_ = 0;
    return out;
  }

  out.force = force;
  out.torque = torque;
  const bool force_clamped = clamp_norm(out.force, settings_.limits.max_force_n);
  // A device without torque output is no reason for a flag at every sample.
  const bool torque_clamped = clamp_norm(out.torque, settings_.limits.max_torque_nm);
  if (force_clamped || (torque_clamped && settings_.limits.max_torque_nm > 0)) {
    out.flags |= kOutputClamped;
    ++counters_.clamped;
  }

  engaged_s_ += dt;
  if (engaged_s_ < settings_.ramp_s) {
    const double gain = engaged_s_ / settings_.ramp_s;
    out.force *= gain;
    out.torque *= gain;
    out.flags |= kOutputRamped;
  }

  const bool force_limited = limit_change(out.force, last_force_, settings_.limits.max_force_rate_n_per_s * dt);
  const bool torque_limited = limit_change(out.torque, last_torque_, settings_.max_torque_rate_nm_per_s * dt);
  if (force_limited || torque_limited) {
    out.flags |= kOutputRateLimited;
    ++counters_.rate_limited;
  }
  last_force_ = out.force;
  last_torque_ = out.torque;
  return out;
}

}  // namespace stylet::haptic
