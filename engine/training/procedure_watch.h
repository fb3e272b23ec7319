// What the course of a session goes by, taken from every simulation step to whoever follows it.
#pragma once

#include "engine/content/tissue_locator.h"
#include "engine/procedures/interface/procedure.h"
#include "engine/session/coupled_loops.h"
#include "physics/messages/latest_value.h"

#include <Eigen/Core>

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace stylet::training {

struct Watched {
  procedures::Situation now;
  int tip_tissue = 0;                                    ///< index into Scene::tissues; 0: outside
  std::unique_ptr<procedures::Observation> observation;  ///< of the procedure; may be null
};

/// Steps as procedures see them: where the tip is in the tissue, how far the targets are. One thread.
class StepReader {
public:
  /// Keeps a reference to `scene`.
  explicit StepReader(const content::Scene& scene);
  /// Fills `now` (target_distances sized as the scene's targets), but for presses and observation.
  procedures::Step read(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                        const physics::TissueState& tissue, const physics::NeedleState& needle,
                        procedures::Situation& now);
  /// A situation with memory for the scene's targets.
  procedures::Situation situation() const;

private:
  void look_at_targets(procedures::Situation& now, const procedures::Step& step, double elapsed_s);

  const content::Scene& scene_;
  content::TissueLocator tissue_;
  std::vector<content::TissueLocator::Carrier> targets_;  // [Scene::targets]
  std::vector<Eigen::Vector3d> from_target_;              // [Scene::targets] to the tip, a step ago
  std::vector<Eigen::Vector3d> centers_;                  // [Scene::targets] now
  Eigen::Vector3d last_tip_ = Eigen::Vector3d::Zero();
  double last_s_ = -1;
};

/// Listens on the loops' threads, is asked from one other: neither waits for the other.
class ProcedureWatch final : public session::StepListener {
public:
  /// @param procedure  observes the steps too, outlives this; null: there is none
  ProcedureWatch(const content::Scene& scene, procedures::Procedure* procedure);

  void fill_cavities(std::span<double> shares) override {
    if (procedure_ != nullptr) procedure_->fill_cavities(shares);
  }
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  /// Of the newest simulation step; the same until the next call. The asking thread's.
  const Watched& latest();

private:
  procedures::Procedure* procedure_;
  StepReader reader_;
  std::uint32_t buttons_ = 0;  // haptic thread's
  std::atomic<std::uint32_t> presses_{0};
  physics::LatestValue<Watched> watched_;
};

}  // namespace stylet::training
