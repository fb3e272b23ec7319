// A needle led by hand through the cube of a reference insertion, instead of along its motion.
#pragma once

#include "tools/reference/reference_insertion.h"

#include <cmath>

namespace stylet::reference {

/// Where the hub is, from where the insertion starts. The needle points along +x.
struct HubPlace {
  double along = 0;  ///< into the cube, m
  double aside = 0;  ///< along +y, m
  double roll = 0;   ///< about the needle's axis, rad
};

/// Both loops in lockstep, the hub from place to place.
class LedNeedle {
public:
  LedNeedle(const ReferenceInsertion& insertion, const ReferenceRun& run)
      : experiment_(insertion, run), start_(insertion.base(0)), dt_(1 / insertion.haptic_hz) {}

  /// Leads the hub to a place in that time, smoothly, and calls `each` after every haptic step.
  template <typename Each>
  void lead(const HubPlace& to, double seconds, Each each) {
    lead_timed(
        to, seconds, [] {}, each);
  }
  /// The same, and calls `begin` before every haptic step.
  template <typename Begin, typename Each>
  void lead_timed(const HubPlace& to, double seconds, Begin begin, Each each) {
    const HubPlace from = at_;
    const int steps = static_cast<int>(std::lround(seconds / dt_));
    for (int i = 1; i <= steps; ++i) {
      const double u = static_cast<double>(i) / steps;
      const double s = u * u * (3 - 2 * u);
      at_ = {from.along + s * (to.along - from.along), from.aside + s * (to.aside - from.aside),
             from.roll + s * (to.roll - from.roll)};
      if (step_++ % experiment_.insertion().haptic_steps_per_simulation_step() == 0) experiment_.simulation_step();
      begin();
      experiment_.haptic().step(hub(), dt_, experiment_.patch_in_use());
      flags_ |= needle().flags;
      each(needle());
    }
  }
  void lead(const HubPlace& to, double seconds) {
    lead(to, seconds, [](const physics::NeedleState&) {});
  }

  const physics::NeedleState& needle() const { return experiment_.needle(); }
  physics::StylusPose hub() const {
    physics::StylusPose pose = start_;
    pose.position += Eigen::Vector3d(at_.along, at_.aside, 0);
    pose.orientation = Eigen::AngleAxisd(at_.roll, Eigen::Vector3d::UnitX()) * start_.orientation;
    return pose;
  }
  ReferenceExperiment& experiment() { return experiment_; }
  double dt() const { return dt_; }
  std::uint32_t flags() const { return flags_; }  ///< NeedleFlag bits ever seen

private:
  ReferenceExperiment experiment_;
  physics::StylusPose start_;
  double dt_;  // s
  HubPlace at_;
  int step_ = 0;
  std::uint32_t flags_ = 0;
};

}  // namespace stylet::reference
