#include "physics/contact/probe_grip.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

// W knows the body at rest, and a squeezed one is stiffer: Newton's step is that of so many times the stiffness.
constexpr double kStifferThanTold = 2;

}  // namespace

ProbeGrip::ProbeGrip(const ProbeContactSettings& settings)
    : force_(settings.grip_force), yield_(settings.grip_yield) {}

RigidPose ProbeGrip::head(const RigidPose& held) {
  const Eigen::Vector3d axis = held.orientation * Eigen::Vector3d::UnitZ();
  if (held_before_) yielded_ += lost_share_ * (held.position - *held_before_).dot(axis);
  yielded_ = std::max(0.0, yielded_);
  held_before_ = held.position;
  return {held.position - yielded_ * axis, held.orientation};
}

void ProbeGrip::feel(const RigidPose& head, ProbeContact& contact) {
  contact.yielded = yielded_;
  const double force = std::max(0.0, -contact.wrench.force.dot(head.orientation * Eigen::Vector3d::UnitZ()));
  const double ratio = force / force_;
  const double slope = 4 * yield_ / force_ * ratio * ratio * ratio;  // of s over F, m/N
  const double softer = slope * contact.stiffness;
  if (!std::isfinite(softer)) {  // else the head would be nowhere for good
    yielded_ = lost_share_ = 0;
    return;
  }
  yielded_ += (yield_ * ratio * ratio * ratio * ratio - yielded_) / (1 + kStifferThanTold * softer);
  lost_share_ = softer / (1 + softer);
  contact.stiffness *= 1 - lost_share_;
}

void ProbeGrip::release() {
  yielded_ = lost_share_ = 0;
  held_before_.reset();
}

}  // namespace stylet::physics
