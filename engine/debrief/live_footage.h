// A session kept while it runs: its debrief then takes no replay.
#pragma once

#include "engine/debrief/footage.h"
#include "engine/session/coupled_loops.h"
#include "engine/state/state_buffer.h"
#include "engine/training/shown_history.h"

namespace stylet::debrief {

/// A listener of the session, told of steps after whoever publishes its frames. Simulation thread while the session
/// runs; afterwards as Footage.
class LiveFootage final : public Footage, public session::StepListener {
public:
  static constexpr std::size_t kMemory = std::size_t{256} << 20;  ///< bytes of frames, at most

  explicit LiveFootage(const content::Scene& scene);
  /// Where the frames come from, before the first step; outlives the steps.
  void watch(const state::StateBuffer& frames) { buffer_ = &frames; }
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;
  /// The session is over. Keeps references to both.
  void complete(const training::Trace& trace, const training::ShownHistory& shown, double duration_s);

  const FrameHistory& frames() const override { return frames_; }
  bool frame_at(double time_s, state::FrameState& frame) override;
  const training::Trace& trace() const override { return *trace_; }
  double duration_s() const override { return duration_s_; }

private:
  FrameHistory frames_;
  state::FrameState frame_;
  const state::StateBuffer* buffer_ = nullptr;
  const training::Trace* trace_ = nullptr;         // when complete
  const training::ShownHistory* shown_ = nullptr;  // when complete
  double duration_s_ = 0;
};

}  // namespace stylet::debrief
