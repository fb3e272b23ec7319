// A patient of 100,000 degrees of freedom in real time: whether the loops keep their rates.
#include "engine/content/scene.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "tools/bench/scratch.h"
#include "tools/bench/tissue_parts.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace stylet::bench {
namespace {

constexpr const char* kName = "liver_biopsy_fine";
constexpr double kQuickSeconds = 2;

}  // namespace

Report tissue_fine(const BenchOptions& options) {
  const content::Scene scene = readers::load_scene(readers::find_scenario(kName));
  std::size_t nodes = 0;
  std::size_t held = 0;
  for (const content::DeformableBody& body : scene.bodies) {
    nodes += body.mesh.nodes.size();
    held += body.fixed_nodes.size();
  }
  const double whole = scene.motion.stylus.back().time_s;
  const Scratch folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  session::LiveSession live(scene, device,
                            {.duration_s = options.quick ? std::min(whole, kQuickSeconds) : whole,
                             .recording = folder.path() / "session.rec"});
  live.start();
  live.wait();
  const session::RunStatistics run = live.stop();

  Report report;
  const std::string key = "fine.";
  const auto steps = [](const session::LoopRun& loop) { return std::to_string(loop.steps) + " steps"; };
  report.add({.name = key + "degrees_of_freedom", .value = 3.0 * static_cast<double>(nodes), .unit = "1"});
  report.add({.name = key + "degrees_of_freedom.held", .value = 3.0 * static_cast<double>(held), .unit = "1"});
  report.add(noted(at_least(key + "haptic.rate", run.haptic.rate_hz, "Hz", 0.999 * scene.rates.haptic_hz),
                   steps(run.haptic)));
  report.add(at_most(key + "haptic.missed",
                     100.0 * static_cast<double>(run.haptic.missed_deadlines) /
                         static_cast<double>(std::max<std::uint64_t>(run.haptic.steps, 1)),
                     "%", 0.1));
  report.add({.name = key + "haptic.step.median", .value = 1e6 * run.haptic.step_time.median_s, .unit = "us"});
  report.add({.name = key + "haptic.step.p99", .value = 1e6 * run.haptic.step_time.p99_s, .unit = "us"});
  report.add(noted(at_least(key + "simulation.rate", run.simulation.rate_hz, "Hz", 0.99 * scene.rates.simulation_hz),
                   steps(run.simulation)));
  report.add(
      {.name = key + "simulation.step.median", .value = 1e3 * run.simulation.step_time.median_s, .unit = "ms"});
  report.add({.name = key + "simulation.step.p99", .value = 1e3 * run.simulation.step_time.p99_s, .unit = "ms"});
  report.add({.name = key + "simulation.step.max", .value = 1e3 * run.simulation.step_time.max_s, .unit = "ms"});
  report.add({.name = key + "factorizations", .value = static_cast<double>(run.factorisations), .unit = "1"});
  return report;
}

}  // namespace stylet::bench
