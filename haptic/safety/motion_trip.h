// Tells a stylus in a hand from one that was let go, thrown, or reads nonsense.
#pragma once

#include <Eigen/Core>

namespace stylet::haptic {

struct MotionTripSettings {
  double max_speed_m_per_s = 1;
  double max_jump_m = 0.010;   ///< between two readings
  double max_turn_rad = 0.3;   ///< the same
  double smoothing_s = 0.005;  ///< of the speed: reports and steps are not in step
  double rearm_s = 0.1;        ///< slower than half of the limit, without a jump, for so long: armed again
};

enum class MotionTrip { none, speed, jump, waiting };  ///< waiting: tripped before and not armed again yet

class MotionTripwire {
public:
  explicit MotionTripwire(const MotionTripSettings& settings) : settings_(settings) {}

  /// @param motion    of the stylus since the last call, m
  /// @param turn_rad  its angle, 0 to pi
  /// @param dt_s      that it took, positive
  /// @realtime no allocation, O(1)
  MotionTrip step(const Eigen::Vector3d& motion, double turn_rad, double dt_s);
  /// The next motion does not continue the last: the speed starts from rest. A trip stays.
  void rest() { velocity_.setZero(); }
  bool tripped() const { return still_to_wait_s_ > 0; }
  double speed() const { return velocity_.norm(); }  ///< smoothed, m/s

private:
  MotionTripSettings settings_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  double still_to_wait_s_ = 0;
};

}  // namespace stylet::haptic
