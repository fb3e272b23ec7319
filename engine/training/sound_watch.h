// What of a running session is to be heard, for whoever plays it.
#pragma once

#include "engine/recording/recording_writer.h"
#include "engine/session/coupled_loops.h"
#include "engine/sound/cue.h"
#include "engine/training/ear.h"
#include "engine/training/trace.h"

#include <cstdint>
#include <vector>

namespace stylet::training {

/// A listener of the session, told of steps after `trace`. Haptic and simulation thread write, one other reads; what
/// nobody reads is lost.
class SoundWatch final : public session::StepListener {
public:
  /// Keeps references to both.
  SoundWatch(const content::Scene& scene, const TraceRecorder& trace);

  /// @realtime
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  /// Reader: what came since it was asked before; the same until the next call.
  const std::vector<sound::Cue>& take();

private:
  const TraceRecorder& trace_;
  Ear ear_;                        // simulation thread's
  std::vector<sound::Cue> heard_;  // simulation thread's
  std::uint32_t punctures_ = 0;    // haptic thread's
  recording::ByteRing of_haptic_;
  recording::ByteRing of_simulation_;
  std::vector<std::uint8_t> bytes_;  // reader's
  std::vector<sound::Cue> taken_;    // reader's
};

}  // namespace stylet::training
