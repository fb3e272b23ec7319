#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "tools/bench/mechanics_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace stylet::bench {
namespace {

/// The scenario's recorded motion, breathing all the while: at `amplitude`, `faster` times as fast.
void breathe(const std::string& scenario, double amplitude, double faster, double seconds, Report& report) {
  content::Scene scene = readers::load_scene(readers::find_scenario(scenario));
  scene.breathing.amplitude = amplitude;
  scene.breathing.period /= faster;
  scene.breathing.holds.clear();
  scene.breathing.drawn_once.reset();
  const content::MotionSample first = readers::sample_motion(scene.motion.stylus, 0);
  session::CoupledLoops loops(scene, physics::Coupling::stylet, {first.pose.position, first.pose.orientation}, {});
  physics::TissuePatch patch = loops.make_patch();
  const double dt = 1 / scene.rates.simulation_hz;
  const auto per_step = static_cast<int>(std::lround(scene.rates.haptic_hz / scene.rates.simulation_hz));
  session::LockstepFactors factors;
  int inverted = 0;
  double deepest = 0;
  for (int step = 0; step * dt < seconds; ++step) {
    const auto [take, request] = factors.next();
    const physics::SimulationReport done = loops.simulation_step(step * dt, loops.needle(), take, request, patch);
    factors.stepped(done, loops.worker());
    inverted += done.inverted_tets;
    deepest = std::max(deepest, done.organs.deepest);
    for (int k = 0; k < per_step; ++k) {
      const double now = step * dt + k * loops.haptic_dt();
      const haptic::StylusSample stylus =
          session::stylus_sample(readers::sample_motion(scene.motion.stylus, now), now);
      loops.haptic_step(stylus, patch);
    }
  }
  const std::string key =
      fmt::format("breath.{}.{:.0f}mm_{:.0f}s.", scenario, 15 * amplitude, scene.breathing.period);
  report.add(noted(at_most(key + "inverted", inverted, "1", 0),
                   "tetrahedra, summed over all steps of the recorded insertion; the diaphragm's way, the period"));
  report.add({.name = key + "overlap", .value = 1e3 * deepest, .unit = "mm"});
}

}  // namespace

Report mechanics_breath(const BenchOptions& options) {
  Report report;
  const double seconds = options.quick ? 4 : 14;
  for (const char* scenario : {"liver_biopsy", "rfa"}) {
    for (const double harder : {1.0, 2.0}) {
      if (options.quick && harder == 1) continue;
      breathe(scenario, harder, harder, seconds, report);
    }
  }
  return report;
}

}  // namespace stylet::bench
