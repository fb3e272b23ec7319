// The recorded hand of the default scenario, made rather than recorded: a liver biopsy through an intercostal space.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

namespace stylet::motion {

/// Patient frame, metres, seconds.
struct BiopsyPlan {
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();   ///< where the needle goes through the skin
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< where the tip ends
  double needle_length = 0.150;                      ///< hub to tip
  double sample_hz = 250;
  double wait = 3.4;          ///< s, at the start: until the patient has breathed out and begins to hold
  double lateral = 0.009;     ///< largest sideways excursion of the hub during the insertion
  double steer = -0.010;      ///< sideways place of the hub at the end: what bends the needle round into the target
  double lead = -0.0097;      ///< sideways, how far beside the target the hand aims: what the bend then makes up for
  double beyond = 0.0045;     ///< how far behind the target it aims: what the organ gives way by
  double front = 0;           ///< how far in front of that (+y): what the skin, pressed aslant, carries it back by
  double back = 0.030;        ///< withdrawn by so much and advanced again, once short of the end; 0: one way in
  double last = 0.003;        ///< how far before the end the hand rests and looks
  double last_speed = 0.030;  ///< peak of what then follows, m/s
  bool leaves = false;        ///< withdraws the needle at the end
};

/// Radii between which a target is aimed at, m: in a large one a core is had without going so far back; to a small
/// one the organ gives way by less than to where it would be aimed past it.
inline constexpr double kLeastAimed = 0.0085, kMostAimed = 0.012;

/// An expert's: straight in under sight, a rest, then slowly to where the needle enters a target of that radius, as
/// the briefing has it; fires there and withdraws.
BiopsyPlan demonstration(const Eigen::Vector3d& entry, const Eigen::Vector3d& target, double target_radius,
                         double needle_length);

/// Wait, approach, S-shaped insertion to short of the target, withdrawal, second advance into the target
/// steered by the hub, trigger. The bevel faces so that it steers the same way. Every stroke is a minimum-jerk
/// profile (Flash and Hogan 1985) with a peak of 30 to 42 mm/s; a tremor of 0.04 mm at 7 to 11 Hz lies on top.
/// Deterministic.
content::Motion biopsy_motion(const BiopsyPlan& plan);

}  // namespace stylet::motion
