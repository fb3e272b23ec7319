// A needle pressed into a block of bovine liver, as in Okamura, Simone and O'Leary (2004): the two loops in lockstep.
#pragma once

#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"

#include <memory>
#include <vector>

namespace stylet::reference {

/// SI. The block lies with its back glued to a board; the needle, 18G, stands on the middle of its face.
struct LiverBlockSettings {
  double side = 0.100;   ///< of the face
  double depth = 0.050;  ///< of the block, board to face
  int cells_across = 8;  ///< even; narrow in the middle
  int cells_deep = 5;
  physics::ElasticMaterial material{.young_modulus = 6e3,
                                    .poisson_ratio = 0.49,
                                    .stiffening = 14,
                                    .relaxation = {{{.share = 0.15, .time_s = 0.5}, {.share = 0.35, .time_s = 5}}}};
  double capsule = 600;  ///< modulus times thickness, N/m
  physics::InsertionResistance resistance{.puncture_force = 1.41, .cutting_force = 0.15, .friction_per_length = 18};
  double tip_radius = 0.635e-3;  ///< where it does not stiffen: the needle's own, too
  double gap = 0.009;            ///< between tip and face at the start
  double haptic_hz = 1000;
  double simulation_hz = 50;
};

class LiverBlock {
public:
  explicit LiverBlock(const LiverBlockSettings& settings);

  struct Sample {
    double time_s = 0;
    double travel = 0;  ///< of the hub, m
    double force = 0;   ///< that presses the hand back, N
    bool inside = false;
  };
  /// Moves the hub at a speed, positive into the block; a sample a simulation step.
  void go(double speed, double seconds);

  const std::vector<Sample>& samples() const { return samples_; }
  const physics::NeedleState& needle() const { return haptic_->state(); }
  const physics::SimulationLoop& simulation() const { return *simulation_; }

private:
  physics::StylusPose base() const;

  LiverBlockSettings settings_;
  std::unique_ptr<physics::SimulationLoop> simulation_;
  std::unique_ptr<physics::HapticLoop> haptic_;
  physics::TissuePatch patch_;
  double time_s_ = 0;
  double travel_ = 0;
  std::vector<Sample> samples_;
};

/// n of F ~ d^n, fitted to the logarithms of samples whose depth is over a fifth of the deepest.
/// @param depth  of the tip below the face at rest, m; those not positive are left out
double force_exponent(const std::vector<double>& depth, const std::vector<double>& force);

}  // namespace stylet::reference
