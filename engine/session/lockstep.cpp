#include "engine/session/lockstep.h"

#include "engine/session/stylus_step.h"
#include "haptic/denormals.h"
#include "haptic/paced_loop.h"

#include <algorithm>
#include <cmath>

namespace stylet::session {

RunStatistics run_lockstep(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                           double duration_s, const RunProgress& progress) {
  const haptic::FlushDenormals flush;  // as in the threads, so that a threaded run replays to the same bits
  haptic::MonotonicClock clock;
  haptic::LatencyHistogram haptic_time;
  haptic::LatencyHistogram simulation_time;
  StylusStep hand(loops, device);
  physics::TissuePatch patch = loops.make_patch();
  RunStatistics run{.mode = "lockstep", .duration_s = duration_s};
  const auto steps = static_cast<std::uint64_t>(std::llround(duration_s * scene.rates.haptic_hz));
  const auto ratio =
      static_cast<std::uint64_t>(std::max(1LL, std::llround(scene.rates.haptic_hz / scene.rates.simulation_hz)));
  int since_request = -1;  // simulation steps; -1: none under way
  const std::int64_t begin = clock.now_ns();
  for (std::uint64_t k = 0; k < steps; ++k) {
    const double time_s = static_cast<double>(k) * loops.haptic_dt();
    if (k % ratio == 0) {
      if (since_request >= 0) ++since_request;
      const bool take = since_request >= kLockstepFactorisationSteps;
      const bool request = since_request < 0 || take;
      const std::int64_t start = clock.now_ns();
      const physics::SimulationReport report = loops.simulation_step(time_s, loops.needle(), take, request, patch);
      simulation_time.add(clock.now_ns() - start);
      if (take) since_request = -1;
      if (report.factorisation_requested) {
        loops.worker().step();
        since_request = 0;
      }
      run.factorisations += report.factorisation_taken ? 1 : 0;
      run.simulation_flags |= report.flags;
      run.patch_flags |= patch.flags;
      ++run.simulation.steps;
      if (progress) progress(static_cast<double>(k) / static_cast<double>(steps));
    }
    const std::int64_t start = clock.now_ns();
    const physics::NeedleState& needle = hand.step(time_s, loops.haptic_dt(), patch);
    haptic_time.add(clock.now_ns() - start);
    run.needle_flags |= needle.flags;
  }
  run.wall_s = static_cast<double>(clock.now_ns() - begin) * 1e-9;
  run.haptic = {.steps = steps, .rate_hz = scene.rates.haptic_hz, .step_time = haptic_time.quantiles()};
  run.simulation.rate_hz = scene.rates.simulation_hz;
  run.simulation.step_time = simulation_time.quantiles();
  run.guard = hand.counters();
  return run;
}

}  // namespace stylet::session
