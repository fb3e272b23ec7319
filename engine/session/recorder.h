// Puts a session on record while it runs.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/recording_writer.h"
#include "engine/session/step_hash.h"

namespace stylet::session {

/// Writes every step, and the chained hash of each loop every so many steps. `hash` must be told of a step before
/// this. Events: "entered" and "left" (a body), "puncture" (puncture_event.h), "buttons".
class Recorder final : public StepListener {
public:
  static constexpr std::uint64_t kHapticStepsPerHash = 100;
  static constexpr std::uint64_t kSimulationStepsPerHash = 10;

  Recorder(RecordingWriter& writer, const StepHash& hash, const content::Scene& scene)
      : writer_(writer), hash_(hash), scene_(scene) {}

  void haptic_stepped(const HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState&, const physics::NeedleState&) override;
  /// Writes the final hashes. The loops must have stopped.
  void finish();

private:
  RecordingWriter& writer_;
  const StepHash& hash_;
  const content::Scene& scene_;
  std::uint64_t haptic_step_ = 0;
  std::uint64_t simulation_step_ = 0;
  bool inside_ = false;
  std::uint32_t punctures_ = 0;
  std::uint32_t buttons_ = 0;
};

}  // namespace stylet::session
