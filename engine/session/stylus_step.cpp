#include "engine/session/stylus_step.h"

#include <algorithm>

namespace stylet::session {

StylusStep::StylusStep(CoupledLoops& loops, haptic::Device& device)
    : loops_(loops),
      device_(device),
      renders_force_(device.limits().renders_force),
      guard_(device.limits(), loops.haptic_dt()) {}

const physics::NeedleState& StylusStep::step(double time_s, double elapsed_s, const physics::TissuePatch& patch) {
  haptic::StylusSample sample = device_.read(time_s);
  sample.time_s = time_s;
  const physics::NeedleState& needle = loops_.haptic_step(sample, patch);
  // A step that the physics refused leaves the force of an older pose.
  const bool refused = (needle.flags & (physics::kNeedleNonFinite | physics::kNeedleSolveFailed)) != 0;
  refused_s_ = refused ? refused_s_ + loops_.haptic_dt() : 0;
  const haptic::GuardedWrench out =
      guard_.apply({.force = needle.wrench.force,
                    .torque = needle.wrench.moment,
                    .position = sample.position,
                    .orientation = sample.orientation,
                    .valid = sample.valid,
                    .pose_age_s = sample.age_s + refused_s_,
                    // The simulation may have begun its step after this one did.
                    .patch_age_s = patch.epoch == 0 ? time_s : std::max(0.0, time_s - patch.time_s)},
                   elapsed_s);
  device_.write(out.force, out.torque);
  if (renders_force_) loops_.force_sent(time_s, out);
  return needle;
}

}  // namespace stylet::session
