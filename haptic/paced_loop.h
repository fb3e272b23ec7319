// A step at a fixed rate: the grid of deadlines, and how well it was kept.
#pragma once

#include "haptic/latency_histogram.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <stop_token>

namespace stylet::haptic {

/// A monotonic clock that can wait. Tests bring their own.
class PacingClock {
public:
  virtual ~PacingClock() = default;
  virtual std::int64_t now_ns() = 0;
  /// Returns at `deadline_ns` or later, at once where it has passed.
  virtual void sleep_until_ns(std::int64_t deadline_ns) = 0;
};

/// CLOCK_MONOTONIC (the clock of std::chrono::steady_clock), clock_nanosleep with an absolute time.
class MonotonicClock final : public PacingClock {
public:
  std::int64_t now_ns() override;
  void sleep_until_ns(std::int64_t deadline_ns) override;
};

/// What a step is told of its time.
struct StepTiming {
  std::uint64_t index = 0;        ///< counts executed steps from 0
  std::int64_t scheduled_ns = 0;  ///< the grid point this step belongs to
  std::int64_t started_ns = 0;    ///< when it really started
};

/// How a paced loop fares. The loop writes, any thread may read.
struct LoopStatistics {
  LatencyHistogram wakeup_latency;  ///< start of the step minus its grid point
  LatencyHistogram step_time;       ///< end of the step minus its start
  std::atomic<std::uint64_t> steps{0};
  std::atomic<std::uint64_t> missed{
      0};  ///< deadlines: grid points without a step of their own, and steps that came late
  std::atomic<std::int64_t> first_ns{0};  ///< start of the first step
  std::atomic<std::int64_t> last_ns{0};   ///< start of the latest step

  /// Steps a second over the whole run; 0 before the second step.
  double actual_rate_hz() const;
};

/// Runs `step` at start + k * period, k = 0, 1, ..., until a stop is asked for. A step that is not done when the next
/// grid point passes is a missed deadline: the grid points passed are counted and, but for the last `most_behind` of
/// them, never chased: 0 goes on at the next one in the future; else the next step begins at once, so that steps
/// which are a little too long now and then, or on the average nearly as long as the period, keep their rate.
/// @realtime itself: no allocation, no lock; system calls are the clock and the sleep
void run_paced(PacingClock& clock, std::int64_t period_ns, const std::function<void(const StepTiming&)>& step,
               const std::stop_token& stop, LoopStatistics& statistics, int most_behind = 0);

}  // namespace stylet::haptic
