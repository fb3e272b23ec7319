// What a run of the loops measured of itself.
#pragma once

#include "haptic/latency_histogram.h"
#include "haptic/output_guard.h"

#include <cstdint>
#include <functional>
#include <string>

namespace stylet::session {

struct LoopRun {
  std::uint64_t steps = 0;
  double rate_hz = 0;  ///< steps a second of wall-clock time; nominal in lockstep
  std::uint64_t missed_deadlines = 0;
  haptic::LatencyQuantiles step_time{};  ///< time the step itself took
  haptic::LatencyQuantiles wakeup{};     ///< start of the step after its deadline (threaded)
};

struct RunStatistics {
  std::string mode{};     ///< "threaded", "lockstep" or "replay"
  double duration_s = 0;  ///< session time
  double wall_s = 0;
  LoopRun haptic{};
  LoopRun simulation{};
  std::uint64_t factorisations = 0;    ///< swapped in
  std::uint32_t needle_flags = 0;      ///< all NeedleFlag bits that were ever set
  std::uint32_t simulation_flags = 0;  ///< all SimulationFlag bits
  std::uint32_t patch_flags = 0;       ///< all PatchFlag bits
  haptic::GuardCounters guard{};
  std::string warning{};  ///< what the system refused to the real-time thread
};

/// Share of the run done, [0, 1].
using RunProgress = std::function<void(double share)>;

}  // namespace stylet::session
