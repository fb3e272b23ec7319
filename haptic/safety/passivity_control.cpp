#include "haptic/safety/passivity_control.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic {

PassivityControl::PassivityControl(const PassivitySettings& settings, double period_s)
    : settings_(settings),
      delay_(static_cast<int>(std::lround(std::clamp(settings.delay_s / period_s, 0.0, double{kMaxDelay})))) {
  sent_.fill(Eigen::Vector3d::Zero());
}

bool PassivityControl::step(Eigen::Vector3d& force, const Eigen::Vector3d& motion, double dt) {
  const Eigen::Vector3d velocity = motion / dt;
  const double speed = velocity.norm();
  energy_ += settings_.own_damping * speed * speed * dt - acting().dot(motion);
  bool damped = false;
  if (energy_ < 0 && speed > settings_.min_speed) {
    const double alpha = std::min(-energy_ / (dt * speed * speed), settings_.max_damping);
    force -= alpha * velocity;
    damped = true;
  }
  energy_ = std::min(energy_, acting().squaredNorm() / (2 * settings_.softest));
  if (energy_ < 0) energy_ *= std::exp(-dt / settings_.forget_debt_s);
  return damped;
}

void PassivityControl::sent(const Eigen::Vector3d& force) {
  newest_ = (newest_ + 1) % (kMaxDelay + 1);
  sent_[newest_] = force;
}

const Eigen::Vector3d& PassivityControl::acting() const {
  return sent_[(newest_ + kMaxDelay + 1 - delay_) % (kMaxDelay + 1)];
}

}  // namespace stylet::haptic
