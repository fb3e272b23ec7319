#include "haptic/paced_loop.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace stylet::haptic {

std::int64_t MonotonicClock::now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void MonotonicClock::sleep_until_ns(std::int64_t deadline_ns) {
  const timespec t{.tv_sec = deadline_ns / 1'000'000'000, .tv_nsec = deadline_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

double LoopStatistics::actual_rate_hz() const {
  const std::uint64_t count = steps.load(std::memory_order_relaxed);
  const std::int64_t span = last_ns.load(std::memory_order_relaxed) - first_ns.load(std::memory_order_relaxed);
  return count < 2 || span <= 0 ? 0.0 : 1e9 * static_cast<double>(count - 1) / static_cast<double>(span);
}

void run_paced(PacingClock& clock, std::int64_t period_ns, const std::function<void(const StepTiming&)>& step,
               const std::stop_token& stop, LoopStatistics& statistics, int most_behind) {
  const std::int64_t origin = clock.now_ns();
  std::int64_t grid_index = 0;
  std::uint64_t executed = 0;
  std::uint64_t missed = 0;
  while (!stop.stop_requested()) {
    const std::int64_t scheduled = origin + grid_index * period_ns;
    clock.sleep_until_ns(scheduled);
    if (stop.stop_requested()) break;
    const std::int64_t started = clock.now_ns();
    step({.index = executed, .scheduled_ns = scheduled, .started_ns = started});
    const std::int64_t ended = clock.now_ns();

    statistics.wakeup_latency.add(started - scheduled);
    statistics.step_time.add(ended - started);
    if (executed == 0) statistics.first_ns.store(started, std::memory_order_relaxed);
    statistics.last_ns.store(started, std::memory_order_relaxed);
    statistics.steps.store(++executed, std::memory_order_relaxed);

    // From the next grid point that has not passed back to those that are still chased; what lies before is lost.
    const std::int64_t due = grid_index + 1;
    std::int64_t next = due;
    if (ended > origin + due * period_ns) {
      const std::int64_t future = (ended - origin + period_ns - 1) / period_ns;
      next = std::max(due, future - most_behind);
      missed += static_cast<std::uint64_t>(std::max<std::int64_t>(1, next - due));
    }
    statistics.missed.store(missed, std::memory_order_relaxed);
    grid_index = next;
  }
}

}  // namespace stylet::haptic
