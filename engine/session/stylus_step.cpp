#include "engine/session/stylus_step.h"

#include <algorithm>

namespace stylet::session {

StylusStep::StylusStep(CoupledLoops& loops, haptic::Device& device, double force_scale)
    : loops_(loops),
      device_(device),
      most_force_(device.limits().max_force_n),
      renders_force_(device.limits().renders_force),
      force_scale_(force_scale),
      guard_(device.limits(), loops.haptic_dt()) {}

/// On the hand, to be guarded as all force is. @param needle_force  that goes to it already, N
Eigen::Vector3d StylusStep::click_force(const haptic::StylusSample& sample, double needle_force, double elapsed_s) {
  if (const std::uint32_t asked = clicks_.load(std::memory_order_acquire); asked != begun_) {
    begun_ = asked;
    if (renders_force_) click_.begin(most_force_ - needle_force);
  }
  // What is not well now will not be in the middle of a click.
  if (!sample.valid || refused_s_ > 0) click_.stop();
  if (!click_.under_way()) return Eigen::Vector3d::Zero();
  return click_.step(elapsed_s) * (sample.orientation * Eigen::Vector3d::UnitZ());
}

const physics::NeedleState& StylusStep::step(double time_s, double elapsed_s, const physics::TissuePatch& patch) {
  held_s_ = 0;
  haptic::StylusSample sample = device_.read(time_s);
  sample.time_s = time_s;
  const physics::NeedleState& needle = loops_.haptic_step(sample, patch);
  // A step that the physics refused leaves the force of an older pose.
  const bool refused = (needle.flags & (physics::kNeedleNonFinite | physics::kNeedleSolveFailed)) != 0;
  refused_s_ = refused ? refused_s_ + loops_.haptic_dt() : 0;
  const Eigen::Vector3d force = force_scale_ * needle.wrench.force;
  const haptic::GuardedWrench out =
      guard_.apply({.force = force + click_force(sample, force.norm(), elapsed_s),
                    .torque = force_scale_ * needle.wrench.moment,
                    .position = sample.position,
                    .orientation = sample.orientation,
                    .valid = sample.valid,
                    .pose_age_s = sample.age_s + refused_s_,
                    // The simulation may have begun its step after this one did.
                    .patch_age_s = patch.epoch == 0 ? time_s : std::max(0.0, time_s - patch.time_s)},
                   elapsed_s);
  if (out.force.isZero(0)) click_.stop();  // the guard has seen a fault
  device_.write(out.force, out.torque);
  if (renders_force_) loops_.force_sent(time_s, out);
  return needle;
}

void StylusStep::hold(double time_s, double elapsed_s) {
  held_s_ += elapsed_s;
  begun_ = clicks_.load(std::memory_order_acquire);
  click_.stop();
  const haptic::StylusSample sample = device_.read(time_s);
  const physics::Wrench& wrench = loops_.needle().wrench;
  const double share = force_scale_ * std::max(0.0, 1 - held_s_ / kPauseFade);
  const haptic::GuardedWrench out = guard_.apply({.force = share * wrench.force,
                                                  .torque = share * wrench.moment,
                                                  .position = sample.position,
                                                  .orientation = sample.orientation,
                                                  .valid = sample.valid && share > 0,
                                                  .pose_age_s = sample.age_s},
                                                 elapsed_s);
  device_.write(out.force, out.torque);
}

}  // namespace stylet::session
