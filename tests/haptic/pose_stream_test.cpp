#include "haptic/hid/pose_stream.h"

#include "haptic/hid/force_stylus.h"
#include "haptic/hid/hand_follower.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>
#include <vector>

namespace stylet::haptic::hid {
namespace {

/// Reports of the force stylus, one a millisecond; x of report k is k um.
class PoseStreamTest : public testing::Test {
protected:
  void SetUp() override { one(-1); }  // the first places the clock
  void add(int k, double arrived_ms) {
    ForceStylusPose pose;
    pose.position.x() = k * 1e-6;
    pose.scan_time = static_cast<std::uint16_t>(10 * k);
    stream.add(pack_pose(pose), at(arrived_ms));
  }
  bool end(double now_ms) { return stream.end(at(now_ms)); }
  bool one(int k) { return add(k, k), end(k); }
  static std::int64_t at(double ms) { return static_cast<std::int64_t>((777 + ms) * 1e6); }
  int x_um() const { return static_cast<int>(std::lround(stream.latest().reading.position.x() * 1e6)); }

  StylusMap map{parse_report_descriptor(kForceStylusDescriptor), DeviceProfile{}};
  StreamCounters counters;
  PoseStream stream{map, counters, 0.020};
};

TEST_F(PoseStreamTest, OfAQueueTheNewestCounts) {
  EXPECT_TRUE(one(0));
  for (int k = 1; k <= 5; ++k) add(k, 5);
  EXPECT_TRUE(end(5));
  EXPECT_EQ(x_um(), 5);
  EXPECT_EQ(stream.latest().gaps, 0u);
  EXPECT_EQ(counters.reports, 7u);
  EXPECT_EQ(counters.missing, 0u);
}

TEST_F(PoseStreamTest, TheFirstQueueMayHaveWaited) {
  PoseStream opened(map, counters, 0.020);
  for (int k = 0; k < 3; ++k) {
    ForceStylusPose pose;
    pose.scan_time = static_cast<std::uint16_t>(10 * k);
    opened.add(pack_pose(pose), at(40));  // the reader was kept away from the start
  }
  EXPECT_FALSE(opened.end(at(40)));
  EXPECT_FALSE(opened.latest().connected);
  opened.add(pack_pose({.scan_time = 410}), at(41));
  EXPECT_TRUE(opened.end(at(41)));
}

TEST_F(PoseStreamTest, AFullQueueIsDiscardedAndAFreshReportWaitedFor) {
  for (int k = 0; k < 100; ++k) one(k);
  for (int k = 100; k < 163; ++k) add(k, 400);  // the reader was away for 300 ms
  EXPECT_FALSE(end(400));
  EXPECT_EQ(x_um(), 99);
  EXPECT_EQ(counters.discarded, 63u);
  EXPECT_TRUE(one(401));
  EXPECT_EQ(x_um(), 401);
  EXPECT_EQ(stream.latest().gaps, 1u);
  EXPECT_EQ(counters.missing, 401u - 163u);
}

TEST_F(PoseStreamTest, AnOldReportIsDiscardedHoweverShortTheQueue) {
  for (int k = 0; k < 100; ++k) one(k);
  for (int k = 100; k < 120; ++k) add(k, 150);  // and then the device was silent too
  EXPECT_FALSE(end(150));
  EXPECT_EQ(x_um(), 99);
}

TEST_F(PoseStreamTest, ASilenceIsAGap) {
  for (int k = 0; k < 10; ++k) one(k);
  EXPECT_TRUE(one(28));
  EXPECT_EQ(stream.latest().gaps, 0u);
  for (int k = 30; k < 328; k += 5) EXPECT_FALSE(end(k));  // the reader looks
  EXPECT_TRUE(one(328));
  EXPECT_EQ(stream.latest().gaps, 1u);
}

TEST_F(PoseStreamTest, RepeatedReportsAreNoNewPose) {
  EXPECT_TRUE(one(5));
  for (int k = 6; k < 10; ++k) {
    add(5, k);
    EXPECT_FALSE(end(k));
  }
  EXPECT_EQ(counters.repeated, 4u);
  EXPECT_EQ(stream.latest().made_ns, at(5));
}

TEST_F(PoseStreamTest, UnreadableReportsChangeNothing) {
  EXPECT_TRUE(one(3));
  const auto report = pack_pose({});
  stream.add(std::span(report).first(20), at(4));
  stream.add(std::vector<std::uint8_t>(60, 1), at(4));
  stream.add(std::vector<std::uint8_t>{9, 1, 2, 3}, at(4));
  EXPECT_FALSE(end(4));
  EXPECT_EQ(x_um(), 3);
  EXPECT_EQ(counters.decoded[static_cast<std::size_t>(Decoded::kTruncated)], 1u);
  EXPECT_EQ(counters.decoded[static_cast<std::size_t>(Decoded::kOversized)], 1u);
  EXPECT_EQ(counters.decoded[static_cast<std::size_t>(Decoded::kUndeclared)], 1u);
}

// The held-out faults of a clock: whatever it says, the host knows since when a report may have been in the queue.
struct PoseAges {
  int sequences = 0;
  int followed = 0;      // in how many the hand was followed in the end
  int jumps = 0;         // of device clocks
  double oldest_ms = 0;  // pose of a valid sample
};

/// A device at 1 kHz whose clock jumps, whose reports get lost, and which falls silent; a reader and a loop that are
/// kept away. A millisecond a step.
PoseAges run_pose_ages(int sequences) {
  constexpr std::int64_t kMs = 1'000'000;
  constexpr int kSteps = 120;
  const StylusMap map(parse_report_descriptor(kForceStylusDescriptor), DeviceProfile{});
  PoseAges ages{.sequences = sequences};
  for (int s = 0; s < sequences; ++s) {
    std::mt19937 random(static_cast<unsigned>(s));
    const auto any = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
    struct Span {
      int from, to;
      bool has(int t) const { return t >= from && t < to; }
    };
    const auto span = [&] {
      const int from = 20 + any(60);
      return Span{from, from + any(70)};
    };
    const Span starved = span(), silent = span(), loop_away = span();
    const std::array<int, 2> jump_at{20 + any(80), 20 + any(80)};
    const bool far = any(1) != 0;
    StreamCounters counters;
    PoseStream stream(map, counters, 0.020);
    HandFollower follower{FollowSettings{}};
    std::vector<int> queue;  // when they were made, ms
    std::array<std::uint16_t, kSteps> stamps{};
    auto offset = static_cast<std::uint16_t>(any(65535));
    int newest = 0;  // made, of those read
    bool valid = false;
    for (int t = 0; t < kSteps; ++t) {
      const std::int64_t now_ns = (777 + t) * kMs;
      for (const int at : jump_at) {
        if (t != at) continue;
        offset = static_cast<std::uint16_t>(offset + (far ? any(65535) : any(1000) - 300));
        ++ages.jumps;
      }
      stamps[static_cast<std::size_t>(t)] = static_cast<std::uint16_t>(offset + 10 * t);
      if (!silent.has(t) && any(50) != 0 && queue.size() < PoseStream::kFullQueue) queue.push_back(t);
      if (!starved.has(t)) {
        for (const int made : queue) {
          stream.add(pack_pose({.scan_time = stamps[static_cast<std::size_t>(made)]}), now_ns);
          newest = made;
        }
        queue.clear();
        stream.end(now_ns);
      }
      if (loop_away.has(t) && any(3) != 0) continue;
      valid = follower.follow(stream.latest(), now_ns).valid;
      if (valid) ages.oldest_ms = std::max<double>(ages.oldest_ms, t - newest);
    }
    ages.followed += valid ? 1 : 0;
  }
  return ages;
}

void expect_bounded_ages(int sequences) {
  const PoseAges ages = run_pose_ages(sequences);
  std::printf("%d sequences with %d jumps of the device's clock: no pose older than %.0f ms\n", ages.sequences,
              ages.jumps, ages.oldest_ms);
  EXPECT_LE(ages.oldest_ms, 20);
  EXPECT_GT(ages.oldest_ms, 10) << "a short silence is bridged";
  EXPECT_GT(ages.followed, sequences / 4) << "the hand is taken up again";
}

TEST(PoseAge, IsBoundedByHostTimeWhateverTheDevicesClockSays) {
  expect_bounded_ages(support::kSanitized ? 1'000 : 20'000);
}

TEST(PoseAge, IsBoundedInAMillionSequences) {
  expect_bounded_ages(support::kSanitized ? 1'000 : 1'000'000);
}

}  // namespace
}  // namespace stylet::haptic::hid
