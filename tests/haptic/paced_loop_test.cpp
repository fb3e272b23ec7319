#include "haptic/paced_loop.h"

#include <gtest/gtest.h>

#include <vector>

namespace stylet::haptic {
namespace {

constexpr std::int64_t kPeriod = 1'000'000;

/// Time moves only when somebody sleeps or works.
class SimulatedClock final : public PacingClock {
public:
  std::int64_t now_ns() override { return now_; }
  void sleep_until_ns(std::int64_t deadline_ns) override {
    if (deadline_ns > now_) now_ = deadline_ns + oversleep_ns;
  }
  void work(std::int64_t ns) { now_ += ns; }

  std::int64_t oversleep_ns = 0;

private:
  std::int64_t now_ = 5'000'000'123;
};

struct PacedRun {
  std::vector<StepTiming> steps;
  LoopStatistics statistics;
};

/// Runs `work_ns.size()` steps that take so long.
void run(PacedRun& out, SimulatedClock& clock, const std::vector<std::int64_t>& work_ns, int most_behind = 0) {
  std::stop_source stop;
  run_paced(
      clock, kPeriod,
      [&](const StepTiming& timing) {
        out.steps.push_back(timing);
        clock.work(work_ns[timing.index]);
        if (out.steps.size() == work_ns.size()) stop.request_stop();
      },
      stop.get_token(), out.statistics, most_behind);
}

TEST(PacedLoop, StepsOnTheGrid) {
  PacedRun r;
  SimulatedClock clock;
  run(r, clock, std::vector<std::int64_t>(100, 200'000));
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(r.steps[i].index, i);
    EXPECT_EQ(r.steps[i].scheduled_ns, r.steps[0].scheduled_ns + static_cast<std::int64_t>(i) * kPeriod);
    EXPECT_EQ(r.steps[i].started_ns, r.steps[i].scheduled_ns);
  }
  EXPECT_EQ(r.statistics.steps, 100u);
  EXPECT_EQ(r.statistics.missed, 0u);
  EXPECT_NEAR(r.statistics.actual_rate_hz(), 1000, 1e-6);
  EXPECT_NEAR(r.statistics.step_time.quantile(0.5), 200e-6, 200e-6 / 64);
  EXPECT_EQ(r.statistics.wakeup_latency.quantile(1.0), 0);
}

TEST(PacedLoop, MissedDeadlineIsCountedAndNotChased) {
  PacedRun r;
  SimulatedClock clock;
  std::vector<std::int64_t> work(20, 100'000);
  work[5] = 3'400'000;  // over grid points 6, 7 and 8: the next step is at 9
  work[8] = 1'000'001;  // a nanosecond late: step at the grid point after
  run(r, clock, work);
  const auto grid = [&](std::size_t i) { return (r.steps[i].scheduled_ns - r.steps[0].scheduled_ns) / kPeriod; };
  EXPECT_EQ(grid(5), 5);
  EXPECT_EQ(grid(6), 9);
  EXPECT_EQ(grid(7), 10);  // and no burst of steps to catch up
  EXPECT_EQ(grid(8), 11);
  EXPECT_EQ(grid(9), 13);
  EXPECT_EQ(grid(19), 23);
  EXPECT_EQ(r.statistics.missed, 4u);
  EXPECT_EQ(r.statistics.steps, 20u);
  for (std::size_t i = 1; i < r.steps.size(); ++i) {
    EXPECT_EQ((r.steps[i].scheduled_ns - r.steps[0].scheduled_ns) % kPeriod, 0);
    EXPECT_GE(r.steps[i].started_ns - r.steps[i - 1].started_ns, kPeriod);
  }
}

TEST(PacedLoop, StepsThatMayBeBehindKeepTheirRate) {
  PacedRun r;
  SimulatedClock clock;
  std::vector<std::int64_t> work(100, 800'000);
  for (std::size_t i = 10; i < 90; i += 2) work[i] = 1'150'000;  // 0.975 ms on the average
  run(r, clock, work, 2);
  for (std::size_t i = 0; i < work.size(); ++i) {
    EXPECT_EQ(r.steps[i].scheduled_ns - r.steps[0].scheduled_ns, static_cast<std::int64_t>(i) * kPeriod);
    if (i > 0) {
      EXPECT_GE(r.steps[i].started_ns, r.steps[i - 1].started_ns + work[i - 1]) << "one after the other";
    }
  }
  EXPECT_EQ(r.statistics.missed, 40u) << "each late end is counted";
  EXPECT_NEAR(r.statistics.actual_rate_hz(), 1000, 2);
}

TEST(PacedLoop, WhatLiesFurtherBehindIsLost) {
  PacedRun r;
  SimulatedClock clock;
  std::vector<std::int64_t> work(20, 100'000);
  work[5] = 6'400'000;  // over grid points 6 to 11: 10 and 11 are caught up with
  run(r, clock, work, 2);
  const auto grid = [&](std::size_t i) { return (r.steps[i].scheduled_ns - r.steps[0].scheduled_ns) / kPeriod; };
  EXPECT_EQ(grid(5), 5);
  EXPECT_EQ(grid(6), 10);
  EXPECT_EQ(grid(7), 11);
  EXPECT_EQ(grid(8), 12);
  EXPECT_EQ(r.steps[8].started_ns, r.steps[8].scheduled_ns) << "on the grid again";
  EXPECT_EQ(r.statistics.missed, 5u) << "6 to 9, and what was late because of it";
}

TEST(PacedLoop, StepThatEndsExactlyAtTheNextGridPointMissesNothing) {
  PacedRun r;
  SimulatedClock clock;
  run(r, clock, std::vector<std::int64_t>(10, kPeriod));
  EXPECT_EQ(r.statistics.missed, 0u);
  EXPECT_NEAR(r.statistics.actual_rate_hz(), 1000, 1e-6);
}

TEST(PacedLoop, LateWakeUpIsLatencyAndDoesNotShiftTheGrid) {
  PacedRun r;
  SimulatedClock clock;
  clock.oversleep_ns = 50'000;
  run(r, clock, std::vector<std::int64_t>(50, 100'000));
  EXPECT_NEAR(r.statistics.wakeup_latency.quantile(0.5), 50e-6, 50e-6 / 64);
  EXPECT_EQ(r.steps[49].scheduled_ns - r.steps[0].scheduled_ns, 49 * kPeriod);
  EXPECT_EQ(r.statistics.missed, 0u);
}

TEST(PacedLoop, WakeUpLaterThanAPeriodMakesOneStepAndCountsTheRest) {
  PacedRun r;
  SimulatedClock clock;
  std::stop_source stop;
  run_paced(
      clock, kPeriod,
      [&](const StepTiming& timing) {
        r.steps.push_back(timing);
        clock.oversleep_ns = timing.index == 2 ? 2'500'000 : 0;  // the host took the processor away
        if (r.steps.size() == 10) stop.request_stop();
      },
      stop.get_token(), r.statistics);
  EXPECT_EQ(r.steps[3].started_ns - r.steps[3].scheduled_ns, 2'500'000);
  EXPECT_EQ(r.steps[4].scheduled_ns - r.steps[3].scheduled_ns, 3 * kPeriod);
  EXPECT_EQ(r.statistics.missed, 2u);
}

TEST(PacedLoop, StopBeforeTheFirstStepMakesNone) {
  PacedRun r;
  SimulatedClock clock;
  std::stop_source stop;
  stop.request_stop();
  run_paced(
      clock, kPeriod, [&](const StepTiming&) { FAIL(); }, stop.get_token(), r.statistics);
  EXPECT_EQ(r.statistics.steps, 0u);
  EXPECT_EQ(r.statistics.actual_rate_hz(), 0);
}

}  // namespace
}  // namespace stylet::haptic
