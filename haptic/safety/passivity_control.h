// Time-domain passivity (Hannaford and Ryu 2002): what gives the hand more energy than it took is damped.
#pragma once

#include <Eigen/Core>

#include <array>

namespace stylet::haptic {

/// SI: for forces N, m and N s/m; for torques N m, rad and N m s/rad.
struct PassivitySettings {
  double max_damping = 2;       ///< that may be added
  double own_damping = 0;       ///< of the device, which dissipates without being asked
  double delay_s = 0;           ///< from sending a force to the pose that it has moved, beyond the sample period
  double min_speed = 1e-4;      ///< below, nothing is added: it would be noise
  double softest = 100;         ///< spring whose energy may be given back undamped, N/m
  double forget_debt_s = 0.03;  ///< time constant in which energy given out too much is forgotten
};

/// Observer and controller of one port, force and motion, in the impedance causality.
///
///   E(n) = E(n-1) - F(n-1-d) . dx(n) + b |v|^2 dt   F on the hand as sent and held, d its delay in samples, dx the
///                                                   motion, v = dx/dt, b the device's own damping: exact for a held
///                                                   force, the controller's damping included
///   F   -= alpha v,  alpha = -E/(dt |v|^2)          where E < 0, at most max_damping
///
/// What the paper leaves open is how to forget, or friction felt once would pay for any later oscillation: E is kept
/// at no more than F^2/(2 softest), which is what a spring that now pulls with F can give back. And it must not damp
/// for ever because a real activity, such as breathing, gave energy: a debt fades with `forget_debt_s`.
class PassivityControl {
public:
  static constexpr int kMaxDelay = 15;  ///< samples

  /// @param period_s  of the calls of sent(), to count the delay in
  PassivityControl(const PassivitySettings& settings, double period_s);

  /// Counts the motion under the force that caused it, and adds damping to `force` where it is due; true then.
  /// @param motion  since the last call
  /// @param dt      that the motion took, s, positive
  /// @realtime no allocation, O(1)
  bool step(Eigen::Vector3d& force, const Eigen::Vector3d& motion, double dt);
  /// Once a sample: the force that is held from now on.
  void sent(const Eigen::Vector3d& force);
  /// Nothing is owed.
  void reset() { energy_ = 0; }
  /// Taken from the hand and not yet given back, J; negative: given too much.
  double energy() const { return energy_; }

private:
  const Eigen::Vector3d& acting() const;

  PassivitySettings settings_;
  int delay_ = 0;  // samples
  std::array<Eigen::Vector3d, kMaxDelay + 1> sent_;
  int newest_ = 0;
  double energy_ = 0;
};

}  // namespace stylet::haptic
