#include "engine/session/needle_base.h"

#include <algorithm>

namespace stylet::session {

double stable_stiffness(double damping, double period_s, double delay_s) {
  return damping / (0.5 * period_s + delay_s);
}

physics::NeedleBase needle_base(const haptic::DeviceLimits& limits, double haptic_hz) {
  constexpr double kShare = 0.5;
  physics::NeedleBase base;
  if (!limits.renders_force) return base;
  const double period_s = 1 / haptic_hz;
  base.kind = physics::BaseKind::spring_damper;
  base.damping = kShare * limits.max_damping_n_s_per_m;
  const double damping = limits.physical_damping_n_s_per_m + base.damping;
  base.stiffness =
      std::min(limits.max_stiffness_n_per_m, kShare * stable_stiffness(damping, period_s, limits.loop_delay_s));
  if (limits.max_torque_nm > 0) {
    base.rotational_damping = kShare * limits.max_rotational_damping_nm_s_per_rad;
    base.rotational_stiffness =
        std::min(limits.max_rotational_stiffness_nm_per_rad,
                 kShare * stable_stiffness(base.rotational_damping, period_s, limits.loop_delay_s));
  }
  return base;
}

}  // namespace stylet::session
