// The windings of a motor warm with the square of the force: what may be held for how long.
#pragma once

#include <algorithm>
#include <cmath>

namespace stylet::haptic {

/// First-order model: heat' = (F^2 - heat) / tau, in units of F^2. Up to half of the heat of the continuous force the
/// peak is allowed; from there to all of it the limit falls in a straight line to the continuous force. So a force
/// held at its limit settles at the continuous one from above, the heat never exceeds what is allowed, and there is
/// no switching that could chatter.
class ThermalLimit {
public:
  /// @param peak, continuous  N (or N m); continuous 0 or above the peak: no limit but the peak
  /// @param time_constant_s   positive
  ThermalLimit(double peak, double continuous, double time_constant_s)
      : peak_(peak), continuous_(continuous > 0 ? std::min(continuous, peak) : peak), tau_(time_constant_s) {}

  /// Norm allowed now.
  double limit() const {
    const double full = continuous_ * continuous_;
    if (!(heat_ > kFree * full)) return peak_;
    return std::max(continuous_, peak_ + (continuous_ - peak_) * (heat_ / full - kFree) / (1 - kFree));
  }
  /// A force of this norm was held for `dt_s`.
  void held(double norm, double dt_s) { heat_ += (norm * norm - heat_) * -std::expm1(-dt_s / tau_); }
  double heat() const { return heat_; }  ///< N^2

private:
  static constexpr double kFree = 0.5;
  double peak_;
  double continuous_;
  double tau_;
  double heat_ = 0;
};

}  // namespace stylet::haptic
