#include "engine/training/replayed_procedure.h"

#include "engine/procedures/kinds.h"

namespace stylet::training {

ReplayedProcedure::ReplayedProcedure(const content::Scene& scene, std::span<const recording::EventRecord> events) {
  const procedures::Kind* kind = procedures::kind_of(scene.exercise);
  if (kind == nullptr) return;
  replay_ = kind->replay(scene, events);
  if (!replay_) return;
  reader_ = std::make_unique<StepReader>(scene);
  now_ = reader_->situation();
}

void ReplayedProcedure::simulation_stepped(const recording::SimulationStepRecord& record,
                                           const physics::SimulationReport& report,
                                           const physics::TissueState& tissue, const physics::NeedleState& needle) {
  if (!replay_ || needle.node_count < 2) return;
  const procedures::Step step = reader_->read(record, report, tissue, needle, now_);
  replay_->observe(step, now_);
}

void ReplayedProcedure::show_at(double time_s, state::FrameState& frame) {
  if (replay_) replay_->show_at(time_s, frame);
}

}  // namespace stylet::training
