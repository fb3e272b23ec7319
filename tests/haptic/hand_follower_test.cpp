#include "haptic/hid/hand_follower.h"

#include <gtest/gtest.h>

namespace stylet::haptic::hid {
namespace {

using Eigen::Vector3d;

/// Steps at 1 kHz with poses 1 ms old.
class HandFollowerTest : public testing::Test {
protected:
  static constexpr std::int64_t kMs = 1'000'000;
  StylusSample step(const Vector3d& hand) {
    pose.reading.position = hand;
    now_ns += kMs;
    pose.made_ns = now_ns - kMs;
    return follower.follow(pose, now_ns);
  }
  StylusSample wait(int ms) {
    now_ns += ms * kMs;
    return follower.follow(pose, now_ns);
  }
  static StreamedPose here() {
    StreamedPose pose{.connected = true};
    pose.reading.in_range = true;
    return pose;
  }

  const Vector3d start{0.1, 0.2, 0.3};
  HandFollower follower{{.workspace = {.start = start}}};
  StreamedPose pose = here();
  std::int64_t now_ns = 1'000'000 * kMs;
};

TEST_F(HandFollowerTest, HubStartsAtItsStartAndFollows) {
  StylusSample sample = step({0.5, 0, 0});
  EXPECT_TRUE(sample.valid);
  EXPECT_TRUE(sample.position.isApprox(start));
  EXPECT_NEAR(sample.age_s, 1e-3, 1e-9);
  sample = step({0.51, 0, 0});
  EXPECT_TRUE(sample.position.isApprox(start + Vector3d(0.01, 0, 0)));
}

TEST_F(HandFollowerTest, WithoutADeviceTheHubRestsAtItsStart) {
  pose.connected = false;
  const StylusSample sample = step({0.5, 0, 0});
  EXPECT_FALSE(sample.valid);
  EXPECT_TRUE(sample.position.isApprox(start));
}

TEST_F(HandFollowerTest, ClutchFreezesTheHubAndTakesTheHandUpElsewhere) {
  step({0, 0, 0});
  const StylusSample before = step({0.01, 0, 0});
  pose.reading.buttons = kSecondaryBarrelButton;
  for (int k = 0; k < 100; ++k) {
    const StylusSample held = step({0.01 + 0.001 * k, 0.05, 0});
    ASSERT_FALSE(held.valid);
    ASSERT_TRUE(held.position.isApprox(before.position));
  }
  pose.reading.buttons = 0;
  EXPECT_TRUE(step({-0.2, 0.1, 0}).position.isApprox(before.position));
  const StylusSample after = step({-0.2, 0.11, 0});
  EXPECT_TRUE(after.valid);
  EXPECT_TRUE(after.position.isApprox(before.position + Vector3d(0, 0.01, 0)));
}

TEST_F(HandFollowerTest, SilenceAgesThePoseAndThenEndsIt) {
  step({0, 0, 0});
  const Vector3d before = step({0.01, 0, 0}).position;
  StylusSample sample = wait(18);
  EXPECT_TRUE(sample.valid);
  EXPECT_NEAR(sample.age_s, 0.019, 1e-9);
  sample = wait(2);
  EXPECT_FALSE(sample.valid);
  EXPECT_TRUE(sample.position.isApprox(before));
  EXPECT_TRUE(step({0.4, 0.4, 0.4}).position.isApprox(before));  // it comes back elsewhere
}

TEST_F(HandFollowerTest, AGapThatNobodySawIsNoJumpEither) {
  step({0, 0, 0});
  const Vector3d before = step({0.01, 0, 0}).position;
  ++pose.gaps;
  const StylusSample gap = step({0.4, 0, 0});
  EXPECT_FALSE(gap.valid);
  EXPECT_TRUE(gap.position.isApprox(before));
  const StylusSample after = step({0.4, 0, 0});
  EXPECT_TRUE(after.valid);
  EXPECT_TRUE(after.position.isApprox(before));
}

TEST_F(HandFollowerTest, UnpluggedHubStaysAndGoesOnAfterTheReturn) {
  step({0, 0, 0});
  const Vector3d before = step({0.01, 0.02, 0}).position;
  pose.connected = false;
  for (int k = 0; k < 50; ++k) EXPECT_FALSE(step({0, 0, 0}).valid);
  EXPECT_TRUE(step({0, 0, 0}).position.isApprox(before));
  pose.connected = true;
  EXPECT_TRUE(step({0.3, 0, 0}).position.isApprox(before));
  EXPECT_TRUE(step({0.3, 0, 0.01}).position.isApprox(before + Vector3d(0, 0, 0.01)));
}

TEST_F(HandFollowerTest, OutOfRangeIsNoPose) {
  step({0, 0, 0});
  pose.reading.in_range = false;
  EXPECT_FALSE(step({0.1, 0, 0}).valid);
}

TEST_F(HandFollowerTest, SpaceMouseDrivesByVelocityAndMayBeSilent) {
  HandFollower mouse({.kind = DeviceKind::kSpaceMouse, .workspace = {.start = start}, .stale_s = 0});
  StreamedPose push{.connected = true};
  push.reading.velocity = {0, 0, -0.02};
  StylusSample sample;
  for (int k = 0; k < 1000; ++k) sample = mouse.follow(push, now_ns += kMs);
  EXPECT_TRUE(sample.valid);
  EXPECT_EQ(sample.age_s, 0);
  EXPECT_NEAR((sample.position - start).z(), -0.02 * (1 - RateSteering{}.smoothing_s), 1e-4);
}

TEST_F(HandFollowerTest, PenAdvancesByPressureAndDrawsBackWithTheBarrel) {
  HandFollower pen({.kind = DeviceKind::kPen, .workspace = {.start = start}, .stale_s = 0});
  StreamedPose at = here();
  at.reading.pressure = 1;
  StylusSample sample;
  for (int k = 0; k < 1000; ++k) sample = pen.follow(at, now_ns += kMs);
  const double depth = (sample.position - start).z();
  EXPECT_NEAR(depth, PenSteering{}.full_speed_m_per_s, 2e-3);
  at.reading.buttons = kBarrelButton;
  for (int k = 0; k < 500; ++k) sample = pen.follow(at, now_ns += kMs);
  EXPECT_LT((sample.position - start).z(), 0.7 * depth);
  at.reading.in_range = false;  // lifted: it stays
  EXPECT_FALSE(pen.follow(at, now_ns += kMs).valid);
}

}  // namespace
}  // namespace stylet::haptic::hid
