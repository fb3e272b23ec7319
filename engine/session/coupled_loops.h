// The two loops of a scene with everything that watches them, stepped by whoever owns the schedule: threads,
// lockstep, or a replay.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/recording.h"
#include "haptic/device.h"
#include "haptic/output_guard.h"
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace stylet::session {

/// Notified of every step, on the thread of the loop that made it: a listener that serves both loops must keep their
/// data apart.
class StepListener {
public:
  virtual ~StepListener() = default;
  /// Before a simulation step that is no replay's: how full the scene's cavities are to be. Simulation thread.
  virtual void fill_cavities(std::span<double> /*shares*/) {}
  /// Before a simulation step that is no replay's: share of a full inspiration, of a patient who listens; none: as
  /// the scene breathes. Simulation thread.
  virtual std::optional<double> inspiration(double /*time_s*/) { return std::nullopt; }
  /// @realtime
  virtual void haptic_stepped(const recording::HapticStepRecord&, const physics::NeedleState&) {}
  virtual void simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport&,
                                  const physics::TissueState&, const physics::NeedleState&) {}
  /// What went to a device that renders force after haptic step `step`; haptic thread.
  /// @realtime
  virtual void force_sent(double /*time_s*/, std::uint64_t /*step*/, const haptic::GuardedWrench&) {}
};

/// Name of a coupling on the command line and in recordings: "stylet", "paper-updated", "paper-trajectory",
/// "paper-frozen".
const char* coupling_name(physics::Coupling coupling);
/// @throws files::ContentError  not a coupling; lists those there are
physics::Coupling coupling_from_name(const std::string& name);

/// What resists the needle, by voxel.
std::shared_ptr<const physics::TissueMap> tissue_map(const content::Scene& scene);

class CoupledLoops {
public:
  /// Builds both loops; factorises the tissue at rest, so it takes a moment.
  /// @param start      pose of the hub before the first step
  /// @param listeners  outlive this; called in this order
  /// @param base       how the needle is held at the stylus
  /// @throws files::ContentError  where the scene's bodies cannot be simulated
  CoupledLoops(const content::Scene& scene, physics::Coupling coupling, const physics::StylusPose& start,
               std::vector<StepListener*> listeners, const physics::NeedleBase& base = {});

  /// A haptic step. An invalid sample leaves the hub where it was.
  /// @realtime
  const physics::NeedleState& haptic_step(const haptic::StylusSample& sample, const physics::TissuePatch& patch);

  /// The same with the input as recorded.
  const physics::NeedleState& haptic_step(const recording::HapticStepRecord& input,
                                          const physics::TissuePatch& patch);

  /// Tells the listeners what went to the device.
  /// @realtime
  void force_sent(double time_s, const haptic::GuardedWrench& out);

  /// A simulation step, the probe where the scene has it. `take` and `request`: see physics::SimulationInput.
  physics::SimulationReport simulation_step(double time_s, const physics::NeedleState& needle, bool take,
                                            bool request, physics::TissuePatch& out);

  /// The same with the probe elsewhere: in a hand, or as recorded.
  /// @param recorded  cavities and breath are this step's; null: as the listeners want them
  physics::SimulationReport simulation_step(double time_s, const physics::NeedleState& needle,
                                            const physics::RigidPose& probe, bool take, bool request,
                                            physics::TissuePatch& out,
                                            const recording::SimulationStepRecord* recorded = nullptr);

  physics::TissuePatch make_patch() const { return simulation_.make_patch(); }
  /// State of the needle: haptic thread, or when that stands still.
  const physics::NeedleState& needle() const { return haptic_.state(); }
  const physics::TissueState& tissue() const { return simulation_.tissue(); }
  physics::FactorisationWorker& worker() { return simulation_.worker(); }
  double haptic_dt() const { return haptic_dt_; }

private:
  const content::Scene& scene_;
  std::vector<StepListener*> listeners_;
  physics::HapticLoop haptic_;
  physics::SimulationLoop simulation_;
  double stale_turn_;  // of a live session, see physics::SimulationInput; the paper's couplings: always anew
  double haptic_dt_;
  physics::StylusPose hub_;
  std::uint64_t haptic_steps_ = 0;
  std::uint64_t simulation_steps_ = 0;
};

/// Arc length of needle behind the skin: from the contact nearest to the hub, in whatever body, to the tip. m
/// @realtime
double insertion_depth(const content::Needle& properties, const physics::NeedleState& needle);

/// Pose of the probe at a time: the motion's probe track where there is one, else the scene's.
physics::RigidPose probe_pose(const content::Scene& scene, double time_s);

}  // namespace stylet::session
