// What the skin does to a probe in a hand that feels it: from the simulation to the loop of that device.
#pragma once

#include "engine/session/coupled_loops.h"
#include "physics/messages/latest_value.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

namespace stylet::session {

/// The skin under the probe as the simulation last found it.
struct Skin {
  bool known = false;                                  ///< there was a simulation step
  double time_s = 0;                                   ///< of it
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the probe's face then, patient frame, m
  bool near = false;                                   ///< there was skin in reach
  double gap = 0;                                      ///< to it, or the reach, where none touched, m
  double force = 0;                                    ///< on the probe, against its axis, N
  double stiffness = 0;                                ///< of that force, N/m
};

/// Hands it over. The simulation thread writes, the device's reads; neither waits.
class FeltSkin final : public StepListener {
public:
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;
  /// Device's thread. @realtime one atomic exchange
  const Skin& newest();

private:
  physics::LatestValue<Skin> skin_;
};

/// Where the probe goes for a hand that feels it, and what the hand feels: hand and probe are held together by a
/// spring, in series with the skin as it was last found, along the axis of the probe:
///   f = k_c (d_h - d) = max(0, f_0 + g k_0 (d - d_0)),   depths d below the skin at rest
/// and while it pushes b d(d_h)/dt damps the hand, as the needle's base does: needle_base() says which k_c and b stay
/// stable on a sampled device. So f never pulls, and is at most that of a spring k_c. g > 1, and skin that is not
/// touched yet is nearly rigid at its gap; where none is in reach yet, at the end of the reach, but no higher than
/// kAbove: between two simulation steps the skin is never softer than it turns out to be, so that what comes with the
/// next one relaxes the force and gives the hand no energy. Depends on its inputs only. @realtime
class SkinCoupling {
public:
  struct Press {
    double depth = 0;  ///< of the probe, m
    double force = 0;  ///< on the hand, against the axis, with the damper's, N
  };

  /// @param stiffness  k_c, N/m @param damping  b, N s/m @param deepest  where the probe stays however the hand
  /// presses, m
  SkinCoupling(double stiffness, double damping, double deepest)
      : stiffness_(stiffness), damping_(damping), deepest_(deepest) {}

  /// @param hand_depth, hand_speed  d_h and its rate, m, m/s
  /// @param skin  the last that was found @param skin_depth  d_0: of skin.position, m
  Press press(double hand_depth, double hand_speed, const Skin& skin, double skin_depth) const;

  static constexpr double kMargin = 1.5;   ///< g
  static constexpr double kRigid = 20;     ///< of skin not touched yet, over k_c
  static constexpr double kAbove = 0.005;  ///< m: moved, the skin stands no higher over where it is at rest

private:
  double stiffness_;
  double damping_;
  double deepest_;
};

}  // namespace stylet::session
