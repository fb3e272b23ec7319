#include "tools/bench/mechanics_parts.h"
#include "tools/reference/two_blocks.h"

#include <fmt/format.h>

#include <algorithm>

namespace stylet::bench {

namespace {

struct Stroke {
  double frequency_hz;
  double latency_s;
};

/// The least of the cycles after the first, in which the bodies still settle.
reference::CycleWork least_cycle(const reference::TwoBlocksRun& run, int cycles) {
  reference::TwoBlocks blocks(run);
  blocks.cycle();
  reference::CycleWork least = blocks.cycle();
  for (int i = 1; i < cycles; ++i) {
    const reference::CycleWork next = blocks.cycle();
    if (next.share() < least.share()) least = next;
  }
  return least;
}

}  // namespace

Report mechanics_passivity(const BenchOptions& options) {
  constexpr double kAsked = -0.1;  // % of peak force x stroke
  Report report;
  for (const bool one_body : {true, false}) {
    for (const Stroke stroke : {Stroke{1, 0}, Stroke{2, 0.008}, Stroke{4, 0.020}}) {
      const reference::CycleWork cycle =
          least_cycle({.frequency_hz = stroke.frequency_hz, .latency_s = stroke.latency_s, .one_body = one_body},
                      options.quick ? 2 : 6);
      const double ms = 1e3 * stroke.latency_s;
      const std::string name = fmt::format("passivity.{}.{:.0f}hz_{:.0f}ms.work_a_cycle",
                                           one_body ? "one_body" : "two_blocks", stroke.frequency_hz, ms);
      report.add(noted(at_least(name, 100 * cycle.share(), "%", kAsked),
                       fmt::format("of peak force {:.2f} N x stroke {:.1f} mm; frictionless needle, simulation at 50 "
                                   "Hz, each message {:.0f} ms late",
                                   cycle.peak_force, 1e3 * cycle.stroke, ms)));
    }
  }
  return report;
}

}  // namespace stylet::bench
