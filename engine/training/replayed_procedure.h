// The procedure of a recorded session, as its replay goes on.
#pragma once

#include "engine/training/procedure_watch.h"

#include <memory>
#include <span>

namespace stylet::training {

/// A listener of the replay. show_at() may be asked from another thread.
class ReplayedProcedure final : public session::StepListener {
public:
  /// @param scene  outlives this; @param events  of the recording
  ReplayedProcedure(const content::Scene& scene, std::span<const recording::EventRecord> events);

  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;
  /// Adds what the procedure showed at that time.
  void show_at(double time_s, state::FrameState& frame);

private:
  std::unique_ptr<procedures::ProcedureReplay> replay_;  // null: it shows nothing
  std::unique_ptr<StepReader> reader_;
  procedures::Situation now_;
};

}  // namespace stylet::training
