// Organs against organs, felt at haptic rate: energy, overlap, how soon forces are right, what it costs.
#include "tools/bench/coupling_parts.h"
#include "tools/bench/mechanics_parts.h"
#include "tools/bench/samples.h"
#include "tools/reference/two_blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <vector>

namespace stylet::bench {
namespace {

struct Cycles {
  double least_work = std::numeric_limits<double>::infinity();  // of peak force x stroke
  double overlap = 0;                                           // largest, m
};

Cycles run_cycles(const reference::TwoBlocksRun& run, int count) {
  reference::TwoBlocks blocks(run);
  blocks.cycle();
  Cycles result;
  const auto steps = std::lround(run.haptic_hz / run.frequency_hz);
  for (int i = 0; i < count; ++i) {
    result.least_work = std::min(result.least_work, blocks.cycle().share());
    for (long k = 0; k < steps; ++k) {
      blocks.step();
      result.overlap = std::max(result.overlap, blocks.report().organs.deepest);
    }
  }
  return result;
}

/// Simulation steps after the hub has stopped, from its fastest, until the force on the hand stays within 1 % of what
/// it comes to.
int settling(bool at_haptic_rate) {
  constexpr double kWithin = 0.01;
  reference::TwoBlocksRun run{.frequency_hz = 4, .at_haptic_rate = at_haptic_rate};
  run.stops_s = 1.0;
  reference::TwoBlocks blocks(run);
  while (blocks.time_s() < run.stops_s - 1e-9) blocks.step();
  std::vector<double> force;
  for (int i = 0; i < static_cast<int>(run.haptic_hz); ++i) {
    blocks.step();
    force.push_back(blocks.needle().wrench.force.norm());
  }
  const double last = force.back();
  const auto wrong = std::find_if(force.rbegin(), force.rend(),
                                  [&](double f) { return std::abs(f - last) > kWithin * std::abs(last); });
  const auto steps = static_cast<double>(force.rend() - wrong);
  return static_cast<int>(std::ceil(steps * run.simulation_hz / run.haptic_hz));
}

/// CPU time of this thread: what else the machine does is no part of a ratio.
Clock::duration thread_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::duration_cast<Clock::duration>(std::chrono::seconds(now.tv_sec) +
                                                     std::chrono::nanoseconds(now.tv_nsec));
}

/// Steps of both ways, alternated every tenth of a second: haptic ones, and those with a simulation step before. The
/// worker has its own thread in a session: it is left out.
struct StepTimes {
  Samples haptic, simulation;
};
std::array<StepTimes, 2> step_times(int cycles) {
  std::array<StepTimes, 2> times;
  for (int i = 0; i < cycles; ++i) {
    reference::TwoBlocksRun run{.frequency_hz = 4, .at_haptic_rate = false};
    reference::TwoBlocks constant(run);
    run.at_haptic_rate = true;
    reference::TwoBlocks followed(run);
    constant.cycle();
    followed.cycle();
    const int steps = static_cast<int>(run.haptic_hz / 10);
    for (int turn = 0; turn < 20; ++turn) {
      reference::TwoBlocks& blocks = turn % 2 == 0 ? constant : followed;
      StepTimes& to = times[turn % 2];
      for (int k = 0; k < steps; ++k) {
        const Clock::duration begin = thread_time();
        const bool both = blocks.step(false);
        (both ? to.simulation : to.haptic).add(thread_time() - begin);
      }
    }
  }
  return times;
}

}  // namespace

Report mechanics_organs(const BenchOptions& options) {
  Report report;
  struct Stroke {
    double frequency_hz, latency_s;
  };
  for (const bool at_haptic_rate : {false, true}) {
    for (const Stroke stroke : {Stroke{1, 0}, Stroke{2, 0.008}, Stroke{4, 0.020}}) {
      const Cycles cycles = run_cycles(
          {.frequency_hz = stroke.frequency_hz, .latency_s = stroke.latency_s, .at_haptic_rate = at_haptic_rate},
          options.quick ? 2 : 6);
      const std::string name = fmt::format("organs.{}.{:.0f}hz_{:.0f}ms", at_haptic_rate ? "followed" : "constant",
                                           stroke.frequency_hz, 1e3 * stroke.latency_s);
      const std::string note = at_haptic_rate ? "contact between two blocks followed at haptic rate"
                                              : "for comparison: constant between simulation steps";
      if (at_haptic_rate) {
        report.add(noted(at_least(name + ".work_a_cycle", kPercent * cycles.least_work, "%", -0.1), note));
        report.add(noted(at_most(name + ".overlap", 1e3 * cycles.overlap, "mm", 0.1), note));
      } else {
        report.add(noted({name + ".work_a_cycle", kPercent * cycles.least_work, "%"}, note));
        report.add(noted({name + ".overlap", 1e3 * cycles.overlap, "mm"}, note));
      }
    }
  }
  for (const bool at_haptic_rate : {false, true}) {
    const Cycles cycles =
        run_cycles({.frequency_hz = 4, .latency_s = 0.020, .gap = 0.002, .at_haptic_rate = at_haptic_rate},
                   options.quick ? 2 : 6);
    const Measurement work{fmt::format("organs.{}.meeting.work_a_cycle", at_haptic_rate ? "followed" : "constant"),
                           kPercent * cycles.least_work,
                           "%",
                           {},
                           {},
                           {}};
    report.add(noted(at_haptic_rate ? at_least(work.name, work.value, "%", -0.1) : work,
                     "4 Hz, 20 ms; 2 mm apart at rest, they meet and part in every stroke"));
  }
  report.add(noted({"organs.constant.settling", static_cast<double>(settling(false)), "steps"},
                   "until the hand's force is within 1 %, after a stop at full speed"));
  report.add(noted(at_most("organs.followed.settling", settling(true), "steps", 2), "the same"));
  const std::array<StepTimes, 2> times = step_times(options.quick ? 1 : 4);
  report.add(at_most("organs.haptic_step.ratio", times[1].haptic.median() / times[0].haptic.median(), "1", 1.3));
  report.add(
      at_most("organs.simulation_step.ratio", times[1].simulation.median() / times[0].simulation.median(), "1", 1.3));
  return report;
}

}  // namespace stylet::bench
