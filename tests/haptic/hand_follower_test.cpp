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
    pose.made_ns = pose.not_before_ns = now_ns - kMs;
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

TEST_F(HandFollowerTest, HubStartsAtItsStartPoseAndFollowsTheHand) {
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

TEST_F(HandFollowerTest, AnUnreportedGapCausesNoJump) {
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

TEST_F(HandFollowerTest, PenMovesTheHubAcrossTheNeedleBothWays) {
  HandFollower pen({.kind = DeviceKind::kPen, .workspace = {.start = start}, .stale_s = 0});
  StreamedPose at = here();
  const auto settle = [&](const Vector3d& place) {
    at.reading.position = place;
    StylusSample sample;
    for (int k = 0; k < 300; ++k) sample = pen.follow(at, now_ns += kMs);
    return sample.position;
  };
  EXPECT_TRUE(settle({0.1, 0, 0.05}).isApprox(start));
  EXPECT_LT((settle({0.12, 0, 0.05}) - start - Vector3d(0.02, 0, 0)).norm(), 1e-6);
  EXPECT_LT((settle({0.12, 0, 0.08}) - start - Vector3d(0.02, 0.03, 0)).norm(), 1e-6) << "towards the trainee";
}

// What the pen does about the tablet's normal the needle does about its own axis.
TEST_F(HandFollowerTest, PenTiltTurnsTheNeedleAndPressureFollowsItsAxis) {
  const Eigen::Quaterniond patient_from_tablet(Eigen::AngleAxisd(2.1, Vector3d(0.36, 0.48, 0.8)));
  const Eigen::Quaterniond first = patient_from_tablet;  // along the tablet's Z
  HandFollower pen(
      {.kind = DeviceKind::kPen,
       .workspace = {.start = start, .start_orientation = first, .patient_from_device = patient_from_tablet},
       .stale_s = 0});
  StreamedPose at = here();
  const auto upright = Eigen::Quaterniond(hid_axes());  // the needle of a pen that stands on the tablet
  const auto tilt_right = [](double angle) {
    return Eigen::Quaterniond(
        Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));  // about near: the upper end to the right
  };
  const auto run = [&](double angle, double pressure, int ms) {
    at.reading.orientation = tilt_right(angle) * upright;
    at.reading.pressure = pressure;
    StylusSample sample;
    for (int k = 0; k < ms; ++k) sample = pen.follow(at, now_ns += kMs);
    return sample;
  };
  EXPECT_LT(run(0, 0, 300).orientation.angularDistance(first), 1e-6);
  double last = 0, worst = 0;
  for (int k = 0; k < 300; ++k) {
    const double turned = run(0.3, 0, 1).orientation.angularDistance(first);
    worst = std::max(worst, turned - last);
    last = turned;
  }
  EXPECT_NEAR(last, 0.3, 1e-6);
  EXPECT_LT(worst, 0.02) << "a step of the tilt is smoothed";
  const StylusSample tilted = run(0.3, 0, 1);
  EXPECT_LT((tilted.position - start).norm(), 1e-9) << "about the hub";
  // The hub is the upper end: its axis now points to the left of the tablet's normal.
  const Vector3d axis = tilted.orientation * Vector3d::UnitZ();
  EXPECT_LT((patient_from_tablet.conjugate() * axis - Vector3d(-std::sin(0.3), 0, std::cos(0.3))).norm(), 1e-6);
  const Vector3d way = run(0.3, 1, 1000).position - tilted.position;
  EXPECT_NEAR(way.norm(), PenSteering{}.full_speed_m_per_s, 2e-3);
  EXPECT_LT(way.normalized().cross(axis).norm(), 1e-3);
}

TEST_F(HandFollowerTest, ScaleOfAPenIsOfItsWayAndNotOfItsPressure) {
  HandFollower pen({.kind = DeviceKind::kPen, .workspace = {.start = start, .scale = 3}, .stale_s = 0});
  StreamedPose at = here();
  at.reading.pressure = 1;
  pen.follow(at, now_ns += kMs);
  at.reading.position = {0.01, 0, 0};
  StylusSample sample;
  for (int k = 0; k < 1000; ++k) sample = pen.follow(at, now_ns += kMs);
  EXPECT_NEAR((sample.position - start).x(), 0.03, 1e-6);
  EXPECT_NEAR((sample.position - start).z(), PenSteering{}.full_speed_m_per_s, 2e-3);
}

TEST_F(HandFollowerTest, LiftedPenMayComeBackElsewhereAndAtAnotherTilt) {
  HandFollower pen({.kind = DeviceKind::kPen, .workspace = {.start = start}, .stale_s = 0});
  StreamedPose at = here();
  StylusSample sample;
  for (int k = 0; k < 100; ++k) sample = pen.follow(at, now_ns += kMs);
  const StylusSample before = sample;
  at.reading.in_range = false;
  pen.follow(at, now_ns += kMs);
  at.reading.in_range = true;
  at.reading.position = {0.1, 0, -0.1};
  at.reading.orientation = Eigen::AngleAxisd(0.5, Vector3d::UnitX());
  for (int k = 0; k < 100; ++k) {
    sample = pen.follow(at, now_ns += kMs);
    ASSERT_TRUE(sample.position.isApprox(before.position));
    ASSERT_LT(sample.orientation.angularDistance(before.orientation), 1e-9);
  }
}

TEST_F(HandFollowerTest, FirstEngagementWaitsForTheRestPlace) {
  HandFollower calibrated({.workspace = {.start = start, .scale = 2, .rest = Vector3d(0.05, 0, 0)}});
  const auto at = [&](const Vector3d& hand) {
    pose.reading.position = hand;
    now_ns += kMs;
    pose.made_ns = pose.not_before_ns = now_ns;
    return calibrated.follow(pose, now_ns);
  };
  EXPECT_FALSE(at({0, 0, 0}).valid);
  EXPECT_FALSE(at({0.039, 0, 0}).valid);
  EXPECT_TRUE(calibrated.waits_for_rest());
  const StylusSample first = at({0.041, 0, 0});
  EXPECT_TRUE(first.valid);
  EXPECT_FALSE(calibrated.waits_for_rest());
  EXPECT_TRUE(first.position.isApprox(start)) << "and nothing jumps";
  EXPECT_TRUE(at({0.101, 0, 0}).position.isApprox(start + Vector3d(0.12, 0, 0)));
  pose.connected = false;
  at({0, 0, 0});
  pose.connected = true;
  EXPECT_TRUE(at({0, 0, 0}).valid) << "only the first";
}

}  // namespace
}  // namespace stylet::haptic::hid
