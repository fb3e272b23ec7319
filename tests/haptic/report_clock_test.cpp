#include "haptic/hid/report_clock.h"

#include <gtest/gtest.h>

namespace stylet::haptic::hid {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart = 50'000 * kMs;

TEST(ReportClock, QueuedReportsAreAsOldAsTheyWaited) {
  ReportClock clock;
  for (int k = 0; k < 100; ++k) clock.stamp(10 * k, kStart + k * kMs);
  // The host sleeps for 300 ms; the ring holds the 63 reports made first, read all at once.
  const std::int64_t woken = kStart + 400 * kMs;
  for (int k = 100; k < 163; ++k) {
    const ReportTime time = clock.stamp(10 * k, woken);
    EXPECT_NEAR(static_cast<double>(time.made_ns - kStart) / kMs, k, 0.3);
    EXPECT_EQ(time.missing, 0u);
  }
  const ReportTime fresh = clock.stamp(4010, woken + kMs);
  EXPECT_NEAR(static_cast<double>(woken + kMs - fresh.made_ns) / kMs, 0, 0.3);
  EXPECT_EQ(fresh.missing, 401u - 163u);
}

TEST(ReportClock, QueuedReportsDoNotChangeThePeriod) {
  ReportClock clock;
  clock.stamp(0, kStart);
  clock.stamp(1, kStart);       // made 0.1 ms later,
  clock.stamp(18'000, kStart);  // and this when somebody listened at last
  for (int k = 1; k < 100; ++k) EXPECT_EQ(clock.stamp(18'000 + 10 * k, kStart + k * kMs).missing, 0u) << k;
  EXPECT_EQ(clock.stamp(18'000 + 10 * 103, kStart + 103 * kMs).missing, 3u);
}

TEST(ReportClock, WrappedStampsGoOn) {
  ReportClock clock;
  for (int k = 0; k < 20'000; ++k) {
    const ReportTime time = clock.stamp((10 * k) & 0xFFFF, kStart + k * kMs);
    ASSERT_NEAR(static_cast<double>(time.made_ns - kStart) / kMs, k, 0.3);
    ASSERT_EQ(time.missing, 0u);
  }
  // Twenty seconds of silence are three times round and more.
  const ReportTime late = clock.stamp((10 * 40'000) & 0xFFFF, kStart + 40'000 * kMs);
  EXPECT_NEAR(static_cast<double>(late.made_ns - kStart) / kMs, 40'000, 10.0);
}

TEST(ReportClock, DelaysOfTheBusAreNotAges) {
  ReportClock clock;
  for (int k = 0; k < 1000; ++k) {
    const std::int64_t delay = k % 7 == 0 ? 3 * kMs : 0;  // some come late
    const ReportTime time = clock.stamp((10 * k) & 0xFFFF, kStart + k * kMs + delay);
    EXPECT_NEAR(static_cast<double>(time.made_ns - kStart) / kMs, k, k == 0 ? 3.1 : 0.3);
  }
}

TEST(ReportClock, ADeviceClockThatRunsFastOrSlowIsFollowed) {
  for (const double rate : {0.9998, 1.0002}) {
    ReportClock clock;
    for (int k = 0; k < 60'000; ++k) {
      const auto ticks = static_cast<std::uint32_t>(10 * k * rate) & 0xFFFF;
      const std::int64_t now = kStart + k * kMs;
      const ReportTime time = clock.stamp(ticks, now);
      ASSERT_NEAR(static_cast<double>(now - time.made_ns) / kMs, 0, 0.5) << rate << " " << k;
    }
  }
}

TEST(ReportClock, ASteppedDeviceClockIsEstimatedAgain) {
  ReportClock clock;
  for (int k = 0; k < 100; ++k) clock.stamp(10 * k, kStart + k * kMs);
  for (int k = 100; k < 200; ++k) {
    const ReportTime time = clock.stamp(10 * (k - 100) + 3, kStart + k * kMs);  // the device has started again
    EXPECT_NEAR(static_cast<double>(time.made_ns - kStart) / kMs, k, 0.3);
    EXPECT_EQ(time.missing, 0u);
  }
}

TEST(ReportClock, AClockThatStoodStillIsMistrustedForHalfASecond) {
  ReportClock clock;
  for (int k = 0; k < 100; ++k) clock.stamp(10 * k, kStart + k * kMs);
  // It stands still for 50 ms; no report comes in that time.
  for (int k = 150; k < 1000; ++k) {
    const ReportTime time = clock.stamp(10 * (k - 50), kStart + k * kMs);
    EXPECT_NEAR(static_cast<double>(kStart + k * kMs - time.made_ns) / kMs, k < 600 ? 50 : 0, 0.6) << k;
  }
}

TEST(ReportClock, AStuckTimeStampIsReported) {
  ReportClock clock;
  EXPECT_FALSE(clock.stamp(500, kStart).repeated);
  EXPECT_TRUE(clock.stamp(500, kStart + kMs).repeated);
  EXPECT_FALSE(clock.stamp(520, kStart + 2 * kMs).repeated);
}

}  // namespace
}  // namespace stylet::haptic::hid
