#include "haptic/workspace_map.h"

#include "haptic/hid/steered_hand.h"

#include <gtest/gtest.h>

#include <numbers>

namespace stylet::haptic::hid {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

const Workspace kWorkspace{.start = {0.1, 0.2, 0.3},
                           .start_orientation = Quaterniond(AngleAxisd(0.4, Vector3d::UnitX())),
                           .patient_from_device = Quaterniond(AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ())),
                           .scale = 2};

TEST(WorkspaceMap, HubStartsAtItsStartWhereverTheHandIs) {
  WorkspaceMap map(kWorkspace);
  map.follow({0.5, -0.4, 0.1}, Quaterniond(AngleAxisd(1, Vector3d::UnitY())));
  EXPECT_TRUE(map.position().isApprox(kWorkspace.start));
  EXPECT_LT(map.orientation().angularDistance(kWorkspace.start_orientation), 1e-12);
}

TEST(WorkspaceMap, HubMovesAlongTheHandsAxesByTheScale) {
  WorkspaceMap map(kWorkspace);
  map.follow(Vector3d::Zero(), Quaterniond::Identity());
  map.follow({0.01, 0, 0}, Quaterniond(AngleAxisd(0.3, Vector3d::UnitX())));
  EXPECT_TRUE(map.position().isApprox(Vector3d(0.1, 0.22, 0.3)));  // the device's x is the patient's y
  const Quaterniond turned(AngleAxisd(0.3, Vector3d::UnitY()));
  EXPECT_LT(map.orientation().angularDistance(turned * kWorkspace.start_orientation), 1e-12);
  EXPECT_TRUE(map.to_device(Vector3d::UnitY()).isApprox(Vector3d::UnitX()));
}

TEST(WorkspaceMap, PoseDoesNotJumpWhenTheHandIsGraspedElsewhere) {
  WorkspaceMap map(kWorkspace);
  map.follow(Vector3d::Zero(), Quaterniond::Identity());
  map.follow({0.02, 0.01, -0.03}, Quaterniond(AngleAxisd(0.5, Vector3d(1, 2, 3).normalized())));
  const Vector3d position = map.position();
  const Quaterniond orientation = map.orientation();
  map.release();
  map.follow({-0.2, 0.1, 0.05}, Quaterniond(AngleAxisd(-2, Vector3d::UnitZ())));
  EXPECT_TRUE(map.position().isApprox(position));
  EXPECT_LT(map.orientation().angularDistance(orientation), 1e-12);
  map.follow({-0.2, 0.11, 0.05}, Quaterniond(AngleAxisd(-2, Vector3d::UnitZ())));
  EXPECT_TRUE((map.position() - position).isApprox(Vector3d(-0.02, 0, 0)));
}

TEST(RateHand, VelocityFollowsTheDeflectionAndIsZeroWhenReleased) {
  RateHand hand;
  HandPose pose;
  for (int k = 0; k < 1000; ++k) pose = hand.step({0.05, 0, 0}, {0, 0.2, 0}, 1e-3);
  // One second at full speed, less what the start takes.
  const RateSteering steering;
  EXPECT_NEAR(pose.position.x(), 0.05 * (1 - steering.smoothing_s), 1e-4);
  EXPECT_NEAR(pose.orientation.angularDistance(Quaterniond::Identity()), 0.2 * (1 - steering.smoothing_s), 1e-3);
  hand.stop();
  const Vector3d at = pose.position;
  pose = hand.step(Vector3d::Zero(), Vector3d::Zero(), 1e-3);
  EXPECT_TRUE(pose.position.isApprox(at));
}

TEST(RateHand, StaysWithinItsReach) {
  RateHand hand;
  HandPose pose;
  for (int k = 0; k < 20'000; ++k) pose = hand.step({0.05, -0.05, 0.05}, {0, 0, 0.3}, 1e-3);
  const RateSteering steering;
  EXPECT_DOUBLE_EQ(pose.position.cwiseAbs().maxCoeff(), steering.reach_m);
  EXPECT_NEAR(pose.orientation.angularDistance(Quaterniond::Identity()), steering.reach_rad, 1e-9);
}

TEST(PenHand, PressureAdvancesAndTheBarrelDrawsBack) {
  PenHand hand;
  const PenSteering steering;
  HandPose pose;
  const Eigen::Vector2d at(0.05, 0.03);
  for (int k = 0; k < 1000; ++k) pose = hand.step({.at = at, .push = 1}, 1e-3);
  EXPECT_NEAR(pose.position.z(), steering.full_speed_m_per_s, 2e-3);
  EXPECT_TRUE(pose.position.head<2>().isApprox(at));
  for (int k = 0; k < 1000; ++k) pose = hand.step({.at = at, .push = -1}, 1e-3);
  EXPECT_NEAR(pose.position.z(), 0, 2e-3);
}

TEST(PenHand, LiftedPenKeepsItsDepth) {
  PenHand hand;
  HandPose pose;
  for (int k = 0; k < 1000; ++k) pose = hand.step({.push = 1}, 1e-3);
  const double depth = pose.position.z();
  hand.lift();
  pose = hand.step({.at = {0.1, 0.1}}, 1e-3);
  EXPECT_NEAR(pose.position.z(), depth, 1e-4);
  EXPECT_TRUE(pose.position.head<2>().isApprox(Eigen::Vector2d(0.1, 0.1)));
}

}  // namespace
}  // namespace stylet::haptic::hid
