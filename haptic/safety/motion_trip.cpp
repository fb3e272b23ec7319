#include "haptic/safety/motion_trip.h"

namespace stylet::haptic {

MotionTrip MotionTripwire::step(const Eigen::Vector3d& motion, double turn_rad, double dt_s) {
  const bool jump =
      !(motion.squaredNorm() <= settings_.max_jump_m * settings_.max_jump_m && turn_rad <= settings_.max_turn_rad);
  if (jump) {
    velocity_.setZero();
    still_to_wait_s_ = settings_.rearm_s;
    return MotionTrip::jump;
  }
  velocity_ += (motion / dt_s - velocity_) * (dt_s / (settings_.smoothing_s + dt_s));
  const double speed = velocity_.norm();
  if (speed > settings_.max_speed_m_per_s) {
    still_to_wait_s_ = settings_.rearm_s;
    return MotionTrip::speed;
  }
  if (still_to_wait_s_ <= 0) return MotionTrip::none;
  still_to_wait_s_ = speed > 0.5 * settings_.max_speed_m_per_s ? settings_.rearm_s : still_to_wait_s_ - dt_s;
  return MotionTrip::waiting;
}

}  // namespace stylet::haptic
