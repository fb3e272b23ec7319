// What the course of a session goes by, taken from every simulation step to whoever follows it.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/training/core_sample.h"
#include "engine/training/electrode.h"
#include "engine/training/flow.h"
#include "engine/training/tissue_locator.h"
#include "physics/messages/latest_value.h"

#include <atomic>
#include <cstdint>
#include <vector>

namespace stylet::training {

/// A core, and when it was cut.
struct Core {
  double time_s = 0;
  std::uint64_t haptic_step = 0;  ///< whose needle it was
  std::vector<double> content{};  ///< share by tissue [Scene::tissues]
};

struct Watched {
  FlowInput input;
  std::uint64_t haptic_step = 0;  ///< that the simulation step consumed
  Electrode electrode;            ///< at rest; where the exercise is an ablation
  int electrode_body = -1;        ///< deformable body that its tip is in
  int tip_tissue = 0;             ///< index into Scene::tissues; 0: outside
  std::uint32_t cores = 0;        ///< asked for and cut, so far
  Core core;                      ///< the last of them
};

/// The target that is nearest to the tip, or to an electrode's bare part; -1: there is none.
int nearest_target(const FlowInput& input);

/// Listens on the loops' threads, is asked from one other: neither waits for the other.
class ProcedureWatch final : public session::StepListener {
public:
  /// Keeps a reference to `scene`.
  explicit ProcedureWatch(const content::Scene& scene);

  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override;

  /// Of the newest simulation step; the same until the next call. The asking thread's.
  const Watched& latest();
  /// The gun is fired: the next simulation step tells what it cut, in Watched::core. The asking thread's.
  void cut_core() { wanted_cores_.fetch_add(1, std::memory_order_release); }

private:
  void look_at_targets(FlowInput& input, const Eigen::Vector3d& tip, const Eigen::Vector3d& axis, double elapsed_s);

  const content::Scene& scene_;
  TissueLocator tissue_;
  std::vector<TissueLocator::Carrier> targets_;  // [Scene::targets]
  std::vector<Eigen::Vector3d> from_target_;     // [Scene::targets] to the tip, a step ago
  Eigen::Vector3d last_tip_ = Eigen::Vector3d::Zero();
  double last_s_ = -1;
  Core core_;
  std::uint32_t cores_ = 0;
  std::uint32_t buttons_ = 0;  // haptic thread's
  std::atomic<std::uint32_t> presses_{0};
  std::atomic<std::uint32_t> wanted_cores_{0};
  physics::LatestValue<Watched> watched_;
};

}  // namespace stylet::training
