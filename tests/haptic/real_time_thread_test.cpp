#include "haptic/real_time_thread.h"
#include "haptic/mouse_device.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <thread>

namespace stylet::haptic {
namespace {

/// Waits for a condition that another thread makes true; a hang is the test's time-out.
template <typename Condition>
void wait_for(Condition condition) {
  while (!condition()) std::this_thread::yield();
}

TEST(RealTimeThread, StepsWithDenormalsFlushedUntilStopped) {
  std::atomic<int> steps{0};
  std::atomic<double> halved{1};
  RealTimeThread thread({.rate_hz = 1000}, [&](const StepTiming&) {
    volatile double smallest = std::numeric_limits<double>::min();
    halved = smallest / 2;
    ++steps;
  });
  wait_for([&] { return steps.load() >= 20; });
  thread.stop();
  const int after = steps.load();
  EXPECT_EQ(thread.statistics().steps.load(), static_cast<std::uint64_t>(after));
  EXPECT_EQ(halved.load(), 0.0);
  EXPECT_NE(std::numeric_limits<double>::min() / 2, 0.0);  // and this thread's arithmetic is as it was
  // Never faster than asked: steps are on the grid, one each, and the first may have come late.
  const double whole = (after - 1) / thread.statistics().actual_rate_hz();
  EXPECT_GE(whole + thread.statistics().wakeup_latency.quantiles().max_s, 1e-3 * (after - 1) - 1e-9);
  EXPECT_GT(thread.statistics().step_time.quantile(0.5), 0);
  thread.stop();
  EXPECT_EQ(steps.load(), after);
}

TEST(RealTimeThread, SaysInOneLineWhatWasRefused) {
  // There is no processor 900 here.
  RealTimeThread thread({.rate_hz = 100, .fifo_priority = 0, .lock_memory = false, .cpu = 900},
                        [](const StepTiming&) {});
  EXPECT_NE(thread.warning().find("processor 900"), std::string::npos) << thread.warning();
  EXPECT_EQ(thread.warning().find('\n'), std::string::npos);
}

TEST(RealTimeThread, RequestsNothingWhenDisabled) {
  RealTimeThread thread({.rate_hz = 100, .fifo_priority = 0, .lock_memory = false}, [](const StepTiming&) {});
  EXPECT_EQ(thread.warning(), "");
}

TEST(RealTimeThread, StatisticsAreReadableWhileItRuns) {
  RealTimeThread thread({.rate_hz = 4000}, [](const StepTiming&) {});
  wait_for([&] { return thread.statistics().wakeup_latency.quantiles().max_s > 0; });
  wait_for([&] { return thread.statistics().actual_rate_hz() > 0; });
}

TEST(RealTimeThread, RefusesARateOutsideItsRange) {
  EXPECT_THROW(RealTimeThread({.rate_hz = 0}, [](const StepTiming&) {}), std::invalid_argument);
  EXPECT_THROW(RealTimeThread({.rate_hz = 1e6}, [](const StepTiming&) {}), std::invalid_argument);
}

TEST(MouseDevice, WindowThreadMovesWhatTheHapticThreadReads) {
  MouseDevice mouse{MouseWorkspace{}};
  std::atomic<double> lateral{0};
  std::atomic<std::uint32_t> buttons{0};
  RealTimeThread thread({.rate_hz = 2000}, [&](const StepTiming& timing) {
    const StylusSample s = mouse.read(1e-9 * static_cast<double>(timing.scheduled_ns));
    lateral = s.position.x();
    buttons = s.buttons;
  });
  for (int i = 0; i < 1000; ++i) mouse.move(1e-5, 0);  // 10 mm in all
  mouse.press(1);
  wait_for([&] { return std::abs(lateral.load() - 0.010) < 1e-6 && buttons.load() == 1; });
}

}  // namespace
}  // namespace stylet::haptic
