#include "haptic/mouse_device.h"
#include "haptic/output_guard.h"
#include "haptic/paced_loop.h"
#include "haptic/recorded_device.h"
#include "haptic/scripted_device.h"
#include "tests/support/allocation_count.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace stylet::haptic {
namespace {

/// Every sleep ends on time at once.
class InstantClock final : public PacingClock {
public:
  std::int64_t now_ns() override { return now_; }
  void sleep_until_ns(std::int64_t deadline_ns) override { now_ = std::max(now_, deadline_ns); }

private:
  std::int64_t now_ = 0;
};

TEST(RealTimeSafety, StepsWithAnyDeviceAllocateNothing) {
  std::vector<StylusSample> track(50);
  for (std::size_t i = 0; i < track.size(); ++i) {
    track[i].time_s = 0.01 * static_cast<double>(i);
    track[i].valid = true;
  }
  RecordedDevice recorded(track);
  ScriptedDevice scripted{ScriptedMotion{}};
  MouseDevice mouse{MouseWorkspace{}};
  OutputGuard guard{DeviceLimits{}};
  InstantClock clock;
  LoopStatistics statistics;
  std::stop_source stop;
  const std::function<void(const StepTiming&)> step = [&](const StepTiming& timing) {
    const double now = 1e-9 * static_cast<double>(timing.scheduled_ns);
    for (Device* device :
         {static_cast<Device*>(&recorded), static_cast<Device*>(&scripted), static_cast<Device*>(&mouse)}) {
      const StylusSample sample = device->read(now);
      const GuardedWrench out =
          guard.apply({.force = 1e3 * sample.position, .position = sample.position, .valid = sample.valid}, 1e-3);
      device->write(out.force, out.torque);
    }
    mouse.advance(1e-4);
    if (timing.index == 1000) stop.request_stop();
  };
  const tests::AllocationCount allocations;
  run_paced(clock, 1'000'000, step, stop.get_token(), statistics);
  EXPECT_EQ(allocations.value(), 0);
  EXPECT_EQ(statistics.steps, 1001u);
  const std::string name = recorded.name() + " is a name too long for the small string buffer";
  EXPECT_GT(allocations.value(), 0);  // the counter counts
}

TEST(RealTimeSafety, GuardAllocatesNothingInAnyOfItsStates) {
  DeviceLimits limits;
  limits.engage_rise_s = 0.05;
  limits.thermal_time_constant_s = 0.5;
  OutputGuard guard{limits};
  const tests::AllocationCount allocations;
  for (int k = 0; k < 4000; ++k) {
    const double away = 1e-4 * k;  // pulled out by the force: it gives energy, and must be damped
    GuardInput input{.force = {k < 300 ? 0.1 : 4.0, 0, 0}, .position = {away, 0, 0}, .valid = k % 1000 != 999};
    if (k % 1000 > 700) input.pose_age_s = 1e-3 * (k % 20);
    if (k % 1000 > 800) input.patch_age_s = 0.3;
    if (k % 1000 == 850) input.force.x() = std::numeric_limits<double>::quiet_NaN();
    if (k % 1000 == 600) input.position.y() = 0.02;
    if (k >= 3500 && k < 3600) input.position.x() += 2e-3 * (k - 3500);
    guard.apply(input, k % 1000 == 900 ? 0.03 : 1e-3);
  }
  EXPECT_EQ(allocations.value(), 0);
  for (int bit = 0; bit < kOutputFlagCount; ++bit) {
    EXPECT_GT(guard.counters().count(static_cast<OutputFlag>(1u << bit)), 0u) << output_flag_name(bit);
  }
}

}  // namespace
}  // namespace stylet::haptic
