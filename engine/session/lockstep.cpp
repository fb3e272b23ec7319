#include "engine/session/lockstep.h"

#include "engine/session/force_scale.h"
#include "haptic/denormals.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::session {

LockstepRun::LockstepRun(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                         const LockstepSettings& settings)
    : loops_(loops),
      scene_(scene),
      settings_(settings),
      hand_(loops, device, force_scale(scene.hand_force, device.limits())),
      patch_(loops.make_patch()),
      ratio_(
          static_cast<std::uint64_t>(std::max(1LL, std::llround(scene.rates.haptic_hz / scene.rates.simulation_hz)))),
      steps_(std::isinf(settings.duration_s)
                 ? std::numeric_limits<std::uint64_t>::max()
                 : static_cast<std::uint64_t>(std::llround(settings.duration_s * scene.rates.haptic_hz))) {}

void LockstepRun::advance(double by_s) {
  const haptic::FlushDenormals flush;  // as in the threads, so that a threaded run replays to the same bits
  if (paused_) return hand_.hold(time_s(), by_s);
  const std::int64_t began_ns = clock_.now_ns();
  asked_s_ += by_s;
  const auto asked = static_cast<std::uint64_t>(std::llround(asked_s_ * scene_.rates.haptic_hz));
  for (const std::uint64_t end = std::min(asked, steps_); step_ < end; ++step_) {
    if (step_ % ratio_ == 0) simulation_step();
    haptic_step();
  }
  run_.wall_s += static_cast<double>(clock_.now_ns() - began_ns) * 1e-9;
}

void LockstepRun::simulation_step() {
  const auto [take, request] = factors_.next();
  const double now_s = time_s();
  const std::int64_t began_ns = clock_.now_ns();
  const physics::RigidPose probe =
      settings_.probe != nullptr ? settings_.probe->pose(now_s) : probe_pose(scene_, now_s);
  const physics::SimulationReport report =
      loops_.simulation_step(now_s, loops_.needle(), probe, take, request, patch_);
  simulation_time_.add(clock_.now_ns() - began_ns);
  factors_.stepped(report, loops_.worker());
  run_.factorisations += report.factorisation_taken ? 1 : 0;
  run_.simulation_flags |= report.flags;
  run_.patch_flags |= patch_.flags;
  ++run_.simulation.steps;
}

void LockstepRun::haptic_step() {
  const std::int64_t began_ns = clock_.now_ns();
  const std::uint32_t flags = hand_.step(time_s(), loops_.haptic_dt(), patch_).flags;
  run_.needle_flags |= flags;
  run_.unresolved.add(flags);
  haptic_time_.add(clock_.now_ns() - began_ns);
}

RunStatistics LockstepRun::statistics() const {
  RunStatistics run = run_;
  run.duration_s = time_s();
  run.haptic = {.steps = step_, .rate_hz = scene_.rates.haptic_hz, .step_time = haptic_time_.quantiles()};
  run.simulation.rate_hz = scene_.rates.simulation_hz;
  run.simulation.step_time = simulation_time_.quantiles();
  run.guard = hand_.counters();
  return run;
}

RunStatistics run_lockstep(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                           double duration_s, const RunProgress& progress) {
  LockstepRun run(loops, device, scene, {.duration_s = duration_s});
  while (!run.finished()) {
    if (progress) progress(run.time_s() / duration_s);
    run.advance(1 / scene.rates.simulation_hz);
  }
  run.stop();
  return run.statistics();
}

}  // namespace stylet::session
