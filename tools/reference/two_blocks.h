// Two blocks, one held and one pushed on it by a frictionless needle that goes to and fro: nothing there may make
// energy, so what the hand gets back in a cycle that it did not put in is the fault of the coupling.
#pragma once

#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace stylet::reference {

struct TwoBlocksRun {
  double frequency_hz = 1;     ///< of the stroke
  double latency_s = 0;        ///< of each message: needle to simulation, patch to haptic loop
  bool one_body = false;       ///< both blocks as one piece: no contact
  double stroke = 0.006;       ///< of the hub, from one end to the other, m
  double depth = 0.005;        ///< of the hub past first touch in the middle of the stroke, m; the tip never lets go
  double gap = 0;              ///< between the blocks at rest, m: they meet and part in every stroke
  double stops_s = 1e9;        ///< the hub stands still from then on
  bool at_haptic_rate = true;  ///< the haptic loop follows the contact between the blocks
  double sideways = 0;         ///< of the needle from the middle of the face, m: the blocks turn on each other
  double haptic_hz = 1000;
  double simulation_hz = 50;
};

/// Of a closed cycle, from the middle of the stroke on the way in to the next.
struct CycleWork {
  double work = 0;        ///< of the hand on the needle, J: negative is energy made
  double peak_force = 0;  ///< on the hand, N
  double stroke = 0;      ///< m
  double share() const { return work / (peak_force * stroke); }
};

/// Both loops in lockstep, each message late by `latency_s`. The needle presses on the middle of the front face,
/// which it cannot break; the front block is held at that face's rim, the back one at its far side. Deterministic.
/// One thread.
class TwoBlocks {
public:
  explicit TwoBlocks(const TwoBlocksRun& run);

  /// One haptic step, with the simulation step due before it.
  /// @param factorises  whether the worker, a thread of its own elsewhere, steps after the simulation
  /// @return whether there was a simulation step
  bool step(bool factorises = true);
  /// First the way in where it is still to come, then one cycle.
  CycleWork cycle();

  double time_s() const { return static_cast<double>(step_) / run_.haptic_hz; }
  const physics::NeedleState& needle() const { return haptic_.state(); }
  /// As the last step was given it.
  physics::StylusPose hub() const { return hub(time_s()); }
  const physics::SimulationReport& report() const { return report_; }
  physics::SimulationLoop& simulation() { return *simulation_; }
  /// NeedleFlag and SimulationFlag bits ever seen.
  std::uint32_t needle_flags() const { return needle_flags_; }
  std::uint32_t simulation_flags() const { return simulation_flags_; }

private:
  struct LatePatch {
    std::uint64_t due = 0;  // haptic step that may use it first
    physics::TissuePatch patch;
  };

  physics::StylusPose hub(double time_s) const;
  void simulation_step(bool factorises);

  TwoBlocksRun run_;
  int steps_a_simulation_step_;
  int latency_steps_;
  std::unique_ptr<physics::SimulationLoop> simulation_;
  physics::HapticLoop haptic_;
  std::vector<physics::NeedleState> states_;  // ring by haptic step, as old as a message may be
  std::vector<LatePatch> patches_;            // ring by simulation step
  std::size_t in_use_ = 0;                    // of patches_
  physics::SimulationReport report_;
  std::uint64_t step_ = 0;
  std::uint64_t simulation_steps_ = 0;
  std::uint32_t needle_flags_ = 0;
  std::uint32_t simulation_flags_ = 0;
};

}  // namespace stylet::reference
