// A frame: its pictures arrive as they are, at the poses of the time they are shown; sizes that change; the room.
#include "tests/headset/rig.h"

#include <cmath>
#include <limits>

namespace stylet::tests {
namespace {

constexpr double kClose = 1e-6;  // of floats of order 1

/// Bytes that differ in every pixel and between the eyes.
std::vector<std::uint8_t> pattern(std::uint32_t width, std::uint32_t height) {
  std::vector<std::uint8_t> bytes(8UL * width * height);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 37 + i / 251);
  return bytes;
}

std::vector<std::uint8_t> eye_of(const std::vector<std::uint8_t>& both, std::size_t eye) {
  const auto half = static_cast<std::ptrdiff_t>(both.size() / 2);
  const auto first = both.begin() + static_cast<std::ptrdiff_t>(eye) * half;
  return {first, first + half};
}

TEST(HeadsetFrame, PicturesArriveByteForByteLeftAndRight) {
  for (const bool bgra_only : {false, true}) {
    Rig rig({.width = 48, .height = 40, .bgra_only = bgra_only});
    const std::vector<std::uint8_t> both = pattern(48, 40);
    {
      const gpu::Image image = two_eyes(rig.device(), 48, 40, both);
      rig.turn_until_focused();
      for (int i = 0; i < 4; ++i) rig.turn(&image);  // each of the runtime's images, and one again
      rig.device().wait_idle();
    }
    const mock::Submitted& last = mock::report().last;
    EXPECT_EQ(last.width, 48U);
    EXPECT_EQ(last.height, 40U);
    for (std::size_t eye = 0; eye < 2; ++eye) EXPECT_EQ(last.rgba[eye], eye_of(both, eye)) << bgra_only << eye;
    rig.expect_clean();
  }
}

TEST(HeadsetFrame, PictureOfAnotherSizeIsScaled) {
  Rig rig({.width = 48, .height = 40});
  std::vector<std::uint8_t> both(8UL * 24 * 20);
  for (std::size_t i = 0; i < both.size(); ++i) both[i] = i < both.size() / 2 ? 60 : 180;
  {
    const gpu::Image image = two_eyes(rig.device(), 24, 20, both);
    rig.turn_until_focused();
    rig.turn(&image);
    rig.device().wait_idle();
  }
  EXPECT_EQ(mock::report().last.rgba[0], std::vector<std::uint8_t>(4UL * 48 * 40, 60));
  EXPECT_EQ(mock::report().last.rgba[1], std::vector<std::uint8_t>(4UL * 48 * 40, 180));
  rig.expect_clean();
}

TEST(HeadsetFrame, AnotherRecommendedSizeMakesOtherImages) {
  Rig rig({.width = 48, .height = 40});
  EXPECT_EQ(rig.turn_until_focused().size, (headset::EyeSize{48, 40}));
  EXPECT_EQ(mock::report().swapchains, 1U);
  mock::resize(64, 56, true);
  EXPECT_EQ(rig.turn()->size, (headset::EyeSize{64, 56}));
  EXPECT_EQ(mock::report().last.width, 64U);
  EXPECT_EQ(mock::report().last.height, 56U);
  // No event tells of a change in the runtime's settings: it is looked for once a second.
  mock::resize(32, 24, false);
  int turns = 0;
  while (rig.turn()->size.width != 32 && ++turns < 200) continue;
  EXPECT_LE(turns, 91);
  EXPECT_EQ(mock::report().swapchains, 3U);
  rig.expect_clean();
}

TEST(HeadsetFrame, ShowsHeadAndHandsWhereTheyWillBeThen) {
  // A head that moves 1 m/s and turns 2 rad/s: a frame's delay would show as 11 mm and 22 mrad.
  const auto head = [](XrTime time) {
    const float t = static_cast<float>(time - 1'000'000'000) * 1e-9F;
    return mock::looking(2 * t, -0.4F, {t, 0.1F * t, -0.2F * t});
  };
  Rig rig({.head = head});
  rig.turn_until_focused();
  for (int i = 0; i < 3; ++i) {
    const auto frame = rig.turn();
    const mock::Report& report = mock::report();
    EXPECT_EQ(report.last.display_time, report.last.predicted_time);
    EXPECT_EQ(report.views_at, report.last.predicted_time);
    EXPECT_EQ(report.hands_at, report.last.predicted_time);
    EXPECT_EQ(frame->display_time_ns, report.last.predicted_time);
    EXPECT_NEAR(frame->period_s, 1.0 / 90, 1e-6);
    const Eigen::Isometry3d local_from_head = isometry(head(report.last.predicted_time));
    for (std::size_t eye = 0; eye < 2; ++eye) {
      const Eigen::Vector3d aside((eye == 0 ? -0.5 : 0.5) * mock::script().eye_separation, 0, 0);
      const Eigen::Isometry3d expected = local_from_head * Eigen::Translation3d(aside);
      EXPECT_TRUE(isometry(report.last.poses[eye]).isApprox(expected, kClose));
      EXPECT_TRUE(frame->eyes[eye].room_from_eye.isApprox(expected, kClose)) << "local space is the room here";
      const XrFovf& fov = report.last.fovs[eye];
      const XrFovf& script = mock::script().fov;
      EXPECT_EQ(fov.angleLeft, eye == 0 ? script.angleLeft : -script.angleRight);
      EXPECT_EQ(fov.angleRight, eye == 0 ? script.angleRight : -script.angleLeft);
      EXPECT_EQ(static_cast<float>(frame->eyes[eye].left), fov.angleLeft);
      EXPECT_EQ(static_cast<float>(frame->eyes[eye].right), fov.angleRight);
      EXPECT_EQ(static_cast<float>(frame->eyes[eye].up), fov.angleUp);
      EXPECT_EQ(static_cast<float>(frame->eyes[eye].down), fov.angleDown);
    }
  }
  rig.expect_clean();
}

TEST(HeadsetFrame, WithoutTrackingNothingIsShown) {
  Rig rig;
  rig.turn_until_focused();
  mock::script().head_tracked = false;
  EXPECT_FALSE(rig.turn()->draw);
  mock::script().head_tracked = true;
  EXPECT_TRUE(rig.turn()->draw);
  mock::script().head = [](XrTime) { return XrPosef{{0, 0, 0, 1}, {std::numeric_limits<float>::quiet_NaN(), 0, 0}}; };
  EXPECT_FALSE(rig.turn()->draw) << "tracked, says the runtime, but nowhere";
  mock::script().head = [](XrTime) { return XrPosef{{0, 0, 0, 1}, {0, 0, 0}}; };
  EXPECT_TRUE(rig.turn()->draw);
  rig.expect_clean();
}

// --- where the trainee stands ---

/// At the table's side, turned, and by mistake tilted.
Eigen::Isometry3d standing(double tilt) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(-0.4, 0.5, 0.3));
  pose.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()));
  pose.rotate(Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()));
  return pose;
}

Eigen::Isometry3d head_of(const headset::HeadsetFrame& frame) {
  Eigen::Isometry3d head = frame.eyes[0].room_from_eye;
  head.translation() = (frame.eyes[0].room_from_eye.translation() + frame.eyes[1].room_from_eye.translation()) / 2;
  return head;
}

TEST(HeadsetRoom, StartsAtTheStandingPlaceWithALevelHorizon) {
  Rig rig({}, {.room_from_standing = standing(-0.5)});
  EXPECT_TRUE(head_of(rig.turn_until_focused()).isApprox(standing(0), kClose));
  rig.expect_clean();
}

TEST(HeadsetRoom, MovesWithTheHeadAlone) {
  XrPosef head{{0, 0, 0, 1}, {0, 0, 0}};
  Rig rig({.head = [&](XrTime) { return head; }}, {.room_from_standing = standing(0)});
  rig.turn_until_focused();
  for (const XrPosef& pose :
       {mock::looking(0.3F, -0.5F, {0.1F, -0.05F, 0}), mock::looking(-2.5F, 0.8F, {0, 0.2F, 0.4F})}) {
    head = pose;
    for (int i = 0; i < 3; ++i)
      EXPECT_TRUE(head_of(*rig.turn()).isApprox(standing(0) * isometry(pose), kClose)) << "and stays when it rests";
  }
  rig.expect_clean();
}

TEST(HeadsetRoom, RecentringPutsTheHeadBackAndKeepsTheHorizon) {
  const XrPosef head = mock::looking(1.9F, -0.6F, {0.5F, 0.3F, 1.1F});
  Rig rig({.head = [&](XrTime) { return head; }}, {.room_from_standing = standing(0)});
  EXPECT_FALSE(head_of(rig.turn_until_focused()).isApprox(standing(0), 0.1));
  rig.headset().recentre();
  const auto frame = rig.turn();
  EXPECT_TRUE(head_of(*frame).isApprox(standing(-0.6), 10 * kClose)) << "it faces there, and still looks down";
  EXPECT_TRUE(
      isometry(mock::report().last.poses[0])
          .translation()
          .isApprox((isometry(head) * Eigen::Translation3d(-0.5 * mock::script().eye_separation, 0, 0)).translation(),
                    kClose))
      << "what the runtime gets are its own poses";
  rig.expect_clean();
}

}  // namespace
}  // namespace stylet::tests
