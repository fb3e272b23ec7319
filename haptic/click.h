// A click in the hand: the recoil of what is fired in the instrument that it holds.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::haptic {

/// Back as it leaves, forth as it is stopped: a force along the instrument's axis
///
///   F(t) = -A sin(2 pi t / T),  0 <= t <= T
///
/// whose impulse is zero, as that of forces between parts of one instrument is. A mass m free to move ends at rest,
/// 0.8 mm back at 45 g, and has at most 2 A^2 / (m w^2) = 0.4 mJ on the way, w = 2 pi / T; any mass from there up
/// with any damping gets less than 1 mJ in all. Engineering values: a hand feels 83 Hz at a hundredth of the force,
/// and A w = 790 N/s is within the rate of a stylus (DeviceLimits). It goes to the hand only through the OutputGuard.
class Click {
public:
  static constexpr double kForce = 1.5;     ///< A at most, N
  static constexpr double kPeriod = 0.012;  ///< T, s

  /// From now on, in place of one under way. @param most  A at most, N: what the device has left
  void begin(double most) {
    force_ = std::clamp(most, 0.0, kForce);
    since_s_ = 0;
  }
  void stop() { force_ = 0; }
  bool under_way() const { return force_ > 0; }

  /// Force along the axis that points away from the hand, held for the next `dt_s`: that of its middle, N.
  /// @realtime
  double step(double dt_s) {
    if (!under_way()) return 0;
    const double middle_s = since_s_ + dt_s / 2;
    since_s_ += dt_s;
    if (!(middle_s >= 0 && middle_s < kPeriod)) {
      stop();
      return 0;
    }
    return -force_ * std::sin(2 * std::numbers::pi * middle_s / kPeriod);
  }

private:
  double force_ = 0;  // A; 0: none is under way
  double since_s_ = 0;
};

}  // namespace stylet::haptic
