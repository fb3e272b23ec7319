// Puts a session on record while it runs.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/recording_writer.h"
#include "engine/session/step_hash.h"

namespace stylet::session {

/// Writes every step, and the chained hash of each loop every so many steps. `hash` must be told of a step before
/// this.
class Recorder final : public StepListener {
public:
  static constexpr std::uint64_t kHapticStepsPerHash = 100;
  static constexpr std::uint64_t kSimulationStepsPerHash = 10;

  Recorder(RecordingWriter& writer, const StepHash& hash) : writer_(writer), hash_(hash) {}

  void haptic_stepped(const HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState&, const physics::NeedleState&) override;
  /// Writes the final hashes. The loops must have stopped.
  void finish();

private:
  RecordingWriter& writer_;
  const StepHash& hash_;
  std::uint64_t haptic_step_ = 0;
  std::uint64_t simulation_step_ = 0;
  physics::TipState tip_ = physics::TipState::outside;
  std::uint32_t buttons_ = 0;
};

}  // namespace stylet::session
