// Hands that go straight: to every target of a phantom in turn, and into one to stay while it is ablated or drained.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <span>

namespace stylet::motion {

/// One insertion after the other. Patient frame, metres, seconds.
struct TourPlan {
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();  ///< where the needle goes into the phantom for the first target
  Eigen::Vector3d apart{-0.006, 0, 0};              ///< from each entry to the next: a needle follows its old hole
  double below = 0.003;    ///< how far under each centre it aims: the surface lifts a tip that comes in at a slant, m
  double inside = 0.0003;  ///< how far into each target it goes: a core is of what lies ahead of the tip, m
  std::span<const content::Target> targets{};
  double needle_length = 0.150;
  double sample_hz = 125;
};
/// To each target in turn, a rest of 1.2 s, and out again. Strokes are minimum-jerk, peak 40 mm/s. The bevel faces
/// the patient's front, so that what it bends the needle by stays in an image plane that the needle lies in.
content::Motion tour_motion(const TourPlan& plan);

/// What the shipped liver gives way by before an electrode, m.
inline constexpr double kLiverYields = 0.002;

struct StayMotionPlan {
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  double exposed = 0.030;  ///< bare tip: its middle comes to lie in the target, m; 0: the tip itself
  double beyond = 0;       ///< how far behind that it aims, m: what the organ gives way by
  double needle_length = 0.150;
  content::Breathing breathing{};
  Eigen::Vector3d carried = Eigen::Vector3d::Zero();  ///< of the target at full inspiration, m
  double pivot_depth = 0.030;                         ///< along the needle below the skin, where the wall holds it, m
  double begin = 4.4;                                 ///< s, of the insertion: in a held breath
  double stay = 14;                                   ///< s after button 1
  bool withdraw = false;                              ///< then, after button 1 again
  double sample_hz = 125;
};
/// Straight in while the breath is held, button 1, then the hand lets the electrode swing with the breath: the tip
/// goes with the liver, the hub the other way round the wall.
content::Motion stay_motion(const StayMotionPlan& plan);

}  // namespace stylet::motion
