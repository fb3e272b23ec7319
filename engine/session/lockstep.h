// A session in one thread on a fixed schedule: the same inputs give the same bits.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/held_probe.h"
#include "engine/session/run_statistics.h"
#include "engine/session/schedule.h"
#include "engine/session/stylus_step.h"
#include "haptic/device.h"
#include "haptic/paced_loop.h"

namespace stylet::session {

/// Simulation steps between the request of a factorisation and its swap: what the asynchronous thread needs for two
/// bodies where cores are short. In lockstep nothing is beside it: making one takes as long as dozens of steps.
inline constexpr int kLockstepFactorisationSteps = 12;

/// When the simulation steps of a run in lockstep ask for a factor and take it: see physics::SimulationInput.
/// One thread.
class LockstepFactors {
public:
  struct Turn {
    bool take = false;
    bool request = false;
  };
  /// Of the next simulation step.
  Turn next() {
    if (since_request_ >= 0) ++since_request_;
    const bool take = since_request_ >= kLockstepFactorisationSteps;
    if (take) since_request_ = -1;
    return {.take = take, .request = since_request_ < 0};
  }
  /// After it: the worker does what it was asked for.
  void stepped(const physics::SimulationReport& report, physics::FactorisationWorker& worker) {
    if (!report.factorisation_requested) return;
    worker.step();
    since_request_ = 0;
  }

private:
  int since_request_ = -1;  // simulation steps; -1: no factorisation under way
};

struct LockstepSettings {
  double duration_s = 0;       ///< session time; infinity: until its caller stops
  HeldProbe* probe = nullptr;  ///< moves the probe; null: the scene does
};

/// N = haptic rate / simulation rate haptic steps to every simulation step, which comes first and consumes the latest
/// needle. The device gets its force through an OutputGuard. All on the caller's thread.
class LockstepRun final : public Schedule {
public:
  /// What is passed in outlives this.
  LockstepRun(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
              const LockstepSettings& settings);

  void advance(double by_s) override;
  double time_s() const override { return static_cast<double>(step_) * loops_.haptic_dt(); }
  double time_of(std::int64_t /*clock_ns*/) const override { return -1; }
  void pause() override { paused_ = true; }
  void resume() override { paused_ = false; }
  bool paused() const override { return paused_; }
  void click() override { hand_.click(); }
  bool finished() const override { return step_ >= steps_; }
  void stop() override { hand_.release(); }
  RunStatistics statistics() const override;

private:
  void simulation_step();
  void haptic_step();

  CoupledLoops& loops_;
  const content::Scene& scene_;
  LockstepSettings settings_;
  haptic::MonotonicClock clock_;
  StylusStep hand_;
  physics::TissuePatch patch_;
  std::uint64_t ratio_;     // haptic steps to a simulation step
  std::uint64_t steps_;     // haptic, of the whole run
  std::uint64_t step_ = 0;  // the next one
  double asked_s_ = 0;      // session time advanced to
  LockstepFactors factors_;
  bool paused_ = false;
  RunStatistics run_{.mode = "lockstep"};
  haptic::LatencyHistogram haptic_time_;
  haptic::LatencyHistogram simulation_time_;
};

/// From start to end in one go.
RunStatistics run_lockstep(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                           double duration_s, const RunProgress& progress = {});

}  // namespace stylet::session
