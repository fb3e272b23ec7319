#include "haptic/hid/pose_stream.h"

#include "haptic/hid/force_stylus.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace stylet::haptic::hid
