// A probe in the hand: where the keys send it, smoothly, and replayed to the same bits.
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/probe_hand.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/session/step_hash.h"
#include "tests/session/pressed_cube.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stylet::session {
namespace {

using tests::pressed_cube;

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b);
}

TEST(HeldProbe, StaysWhereTheSceneHasItUntilItIsMoved) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  for (double t : {0.0, 0.02, 0.04}) {
    EXPECT_EQ(probe.pose(t).position, scene.probe.pose.position);
    EXPECT_EQ(probe.pose(t).orientation.coeffs(), scene.probe.pose.orientation.coeffs());
  }
}

TEST(HeldProbe, StandsAtItsStartFromTheFirstMomentAndGoesBackThere) {
  const content::Scene scene = pressed_cube();
  const content::ProbeMove start{.lateral = -0.02, .elevation = 0.01, .twist = 0.3};
  const physics::RigidPose there = *content::moved_on_skin(scene.probe.pose, scene.labels, start);
  HeldProbe probe(scene, start);
  const auto expect_there = [&](const physics::RigidPose& pose) {
    EXPECT_LT((pose.position - there.position).norm(), 1e-6);
    EXPECT_LT(angle_between(pose.orientation, there.orientation), 1e-6);
  };
  expect_there(probe.pose(0));
  EXPECT_EQ(probe.moved(), start);
  ASSERT_TRUE(probe.move({.lateral = 0.02}, 0));
  double t = 0;
  const auto settled = [&] {
    physics::RigidPose pose;
    for (int step = 0; step < 200; ++step) pose = probe.pose(t += 0.02);
    return pose;
  };
  EXPECT_GT((settled().position - there.position).norm(), 0.015);
  probe.release();
  expect_there(settled());
  // Where there is no skin it stands where the scene has it.
  EXPECT_EQ(HeldProbe(scene, {.lateral = 0.5}).pose(0).position, scene.probe.pose.position);
}

TEST(HeldProbe, GoesWhereATrackerHasItAndNoDeeper) {
  const content::Scene scene = pressed_cube();  // skin at z = 0.1 m, the probe looks down
  HeldProbe probe(scene);
  probe.pose(0);
  double t = 0;
  const auto settled = [&] {
    physics::RigidPose pose;
    for (int step = 0; step < 50; ++step) pose = probe.pose(t += 0.02);
    return pose;
  };
  physics::RigidPose tracked = scene.probe.pose;
  tracked.position = {-0.02, 0.01, 0.12};  // in the air
  tracked.orientation = tracked.orientation * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(probe.follow(tracked));
  const physics::RigidPose in_air = settled();
  EXPECT_LT((in_air.position - tracked.position).norm(), 1e-6);
  EXPECT_LT(angle_between(in_air.orientation, tracked.orientation), 1e-6);

  tracked.orientation = scene.probe.pose.orientation;
  tracked.position.z() = 0.065;  // 35 mm deep: drawn back to 30, to a voxel
  ASSERT_TRUE(probe.follow(tracked));
  EXPECT_NEAR(settled().position.z(), 0.1 - HeldProbe::kDeepest, 0.0025);
  tracked.position.z() = 0.04;
  EXPECT_FALSE(probe.follow(tracked));
  EXPECT_NEAR(settled().position.z(), 0.1 - HeldProbe::kDeepest, 0.0025);

  probe.release();
  settled();
  EXPECT_EQ(settled().position, scene.probe.pose.position);
  ASSERT_TRUE(probe.follow(in_air));
  ASSERT_TRUE(probe.move({.lateral = 0.01}, t));
  settled();
  EXPECT_LT((settled().position - Eigen::Vector3d(0.02, 0, 0.098)).norm(), 2e-5);
}

TEST(HeldProbe, GoesSmoothlyWhereItIsSentAndBack) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  probe.pose(0);
  ASSERT_TRUE(probe.move({.lateral = 0.01, .press = 0.002, .tilt = 0.2}, 0));
  physics::RigidPose last = scene.probe.pose;
  double t = 0;
  for (int step = 0; step < 50; ++step) {
    t += 0.02;
    const physics::RigidPose pose = probe.pose(t);
    // A fifth of the way at most in a step of 20 ms.
    EXPECT_LT((pose.position - last.position).norm(), 0.2 * 0.011);
    last = pose;
  }
  // Lateral is x of the patient here, the probe looks down.
  EXPECT_LT((last.position - Eigen::Vector3d(0.02, 0, 0.096)).norm(), 2e-5);
  EXPECT_NEAR(angle_between(last.orientation, scene.probe.pose.orientation), 0.2, 1e-3);
  probe.release();
  for (int step = 0; step < 100; ++step) last = probe.pose(t += 0.02);
  EXPECT_EQ(last.position, scene.probe.pose.position);
}

TEST(HeldProbe, DoesNotLeaveTheSkin) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  EXPECT_FALSE(probe.move({.lateral = 0.2}, 0));
  EXPECT_EQ(probe.moved(), content::ProbeMove{});
}

TEST(HeldProbe, AThreadedSessionThatItMovedReplaysBitForBit) {
  const content::Scene scene = pressed_cube();
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  HeldProbe probe(scene);
  LiveSession session(scene, device,
                      {.duration_s = 0.6, .recording = folder / "held", .build = "test", .probe = &probe});
  ASSERT_TRUE(probe.move({.elevation = 0.01, .press = 0.003, .rock = 0.1}, 0));
  session.start();
  session.wait();
  session.stop();

  const recording::Recording recording = recording::read_recording(folder / "held");
  ASSERT_FALSE(recording.simulation.empty());
  EXPECT_GT((recording.simulation.back().probe.position - scene.probe.pose.position).norm(), 0.005);
  const RecordedSettings settings = recorded_settings(recording);
  StepHash hash;
  CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  const ReplayResult result = replay(recording, loops, hash);
  EXPECT_TRUE(result.identical());
  EXPECT_EQ(hash.state(), session.state_hash());
}

// --- the same in a hand that a headset tracks ---

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

TEST(ProbeHand, TakesTheProbeUpWhereverTheHandIs) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  ProbeHand hand(scene, probe);
  EXPECT_TRUE(hand.follow({3, 2, 1}, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())), 0));
  const content::ProbeMove move = probe.moved();
  for (const double part : {move.lateral, move.elevation, move.press, move.tilt, move.rock, move.twist})
    EXPECT_NEAR(part, 0, 1e-9);
}

TEST(ProbeHand, SlidesOnTheSkinAndTurnsAsTheHandDoes) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  ProbeHand hand(scene, probe);
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  hand.follow({0, 0, 0}, kLevel, 0);
  ASSERT_TRUE(hand.follow({-0.008, 0.006, 0}, turn, 0));
  physics::RigidPose pose;
  for (int i = 0; i <= 100; ++i) pose = probe.pose(0.02 * i);
  // The cube's upper face is level: there is nothing to follow but the hand.
  EXPECT_TRUE(pose.position.isApprox(scene.probe.pose.position + Eigen::Vector3d(-0.008, 0.006, 0), 1e-4));
  EXPECT_LT(angle_between(pose.orientation, turn * scene.probe.pose.orientation), 1e-3);
}

TEST(ProbeHand, FeelsNoSkinSoItsDepthIsLimited) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  ProbeHand hand(scene, probe);
  hand.follow({0, 0, 0}, kLevel, 0);
  ASSERT_TRUE(hand.follow({0, 0, -0.004}, kLevel, 0));
  EXPECT_NEAR(probe.moved().press, 0.004, 1e-9);
  ASSERT_TRUE(hand.follow({0, 0, -0.2}, kLevel, 0));
  EXPECT_NEAR(probe.moved().press, ProbeHand::kDeepest, 1e-9);
  ASSERT_TRUE(hand.follow({0, 0, 0.2}, kLevel, 0));
  EXPECT_NEAR(probe.moved().press, -ProbeHand::kHighest, 1e-9);
}

TEST(ProbeHand, BeyondTheSkinTheProbeStaysAndReleasedItCanBeGraspedAgain) {
  const content::Scene scene = pressed_cube();
  HeldProbe probe(scene);
  ProbeHand hand(scene, probe);
  hand.follow({0, 0, 0}, kLevel, 0);
  ASSERT_TRUE(hand.follow({0.005, 0, 0}, kLevel, 0));
  const content::ProbeMove before = probe.moved();
  EXPECT_FALSE(hand.follow({0.5, 0, 0}, kLevel, 0));
  EXPECT_EQ(probe.moved(), before);
  hand.release();
  ASSERT_TRUE(hand.follow({0.5, 0, 0}, kLevel, 0));
  EXPECT_NEAR(probe.moved().lateral, before.lateral, 1e-9);
  ASSERT_TRUE(hand.follow({0.495, 0, 0}, kLevel, 0));
  EXPECT_NEAR(std::abs(probe.moved().lateral), 0, 1e-9);
}

}  // namespace
}  // namespace stylet::session
