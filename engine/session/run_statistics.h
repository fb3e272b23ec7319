// What a run of the loops measured of itself.
#pragma once

#include "haptic/latency_histogram.h"
#include "haptic/output_guard.h"
#include "physics/messages/messages.h"

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

/// What the haptic loop could not resolve because the tissue's patches were too late or too small.
struct Unresolved {
  std::uint64_t steps_beyond_patch = 0;  ///< haptic steps with the track or the tip where no patch knows the tissue
  std::uint64_t surfaces_late = 0;       ///< surfaces that the tip had gone through before they were felt, if at all

  /// @param needle_flags  NeedleFlag bits of one haptic step
  void add(std::uint32_t needle_flags) {
    steps_beyond_patch += (needle_flags & physics::kNeedlePatchLeft) != 0 ? 1 : 0;
    surfaces_late += (needle_flags & physics::kNeedleSurfaceLate) != 0 ? 1 : 0;
  }
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
  Unresolved unresolved{};
  haptic::GuardCounters guard{};
  std::string warning{};  ///< what the system refused to the real-time thread
};

/// Share of the run done, [0, 1].
using RunProgress = std::function<void(double share)>;

}  // namespace stylet::session
