// The chained hash of both loops: one number a loop that stands for every bit of its history.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/state_hash.h"

namespace stylet::session {

/// Hashes what each loop hands on: the needle's poses, forces, wrench and punctures; the tissue's positions.
class StepHash final : public StepListener {
public:
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override {
    haptic_.add(record.step);
    haptic_.add_columns(needle.positions, needle.node_count);
    for (int i = 0; i < needle.node_count; ++i) {
      const auto& q = needle.orientations[i].coeffs();
      haptic_.add({q.data(), 4});
    }
    for (int i = 0; i < needle.force_count; ++i) {
      haptic_.add({needle.forces[i].force.data(), 3});
    }
    haptic_.add({needle.wrench.force.data(), 3});
    haptic_.add({needle.wrench.moment.data(), 3});
    haptic_.add(std::uint64_t{needle.flags});
    haptic_.add(needle.hand_work);
    haptic_.add(static_cast<std::uint64_t>(needle.track_count));
    haptic_.add(std::uint64_t{needle.puncture_count});
    if (needle.puncture_count == 0) return;
    haptic_.add(needle.last_puncture.step);
    haptic_.add(static_cast<std::uint64_t>(needle.last_puncture.from));
    haptic_.add(static_cast<std::uint64_t>(needle.last_puncture.to));
    haptic_.add(needle.last_puncture.force);
  }
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport&,
                          const physics::TissueState& tissue, const physics::NeedleState&) override {
    simulation_.add(record.step);
    for (int b = 0; b < tissue.body_count; ++b) {
      const auto& positions = tissue.positions[b];
      simulation_.add_columns(positions, positions.cols());
    }
  }

  std::uint64_t haptic() const { return haptic_.value(); }
  std::uint64_t simulation() const { return simulation_.value(); }
  /// Of both, when both stand still.
  std::uint64_t state() const {
    StateHash both;
    both.add(haptic_.value());
    both.add(simulation_.value());
    return both.value();
  }

private:
  StateHash haptic_;
  StateHash simulation_;
};

}  // namespace stylet::session
