// A probe moved on the skin of a ball stays on it.
#include "engine/content/probe_placement.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stylet::content {
namespace {

constexpr double kBall = 0.1;  // m, radius of a ball about the origin

LabelVolume ball() {
  LabelVolume labels;
  labels.spacing = 0.002F;
  labels.size = {121, 121, 121};
  labels.origin.setConstant(-0.12F);
  for (int k = 0; k < 121; ++k) {
    for (int j = 0; j < 121; ++j) {
      for (int i = 0; i < 121; ++i) {
        const Eigen::Vector3f p = labels.origin + labels.spacing * Eigen::Vector3f(float(i), float(j), float(k));
        labels.labels.push_back(p.norm() <= float(kBall) ? 1 : 0);
      }
    }
  }
  labels.bodies.assign(labels.labels.size(), -1);
  return labels;
}

/// On top of the ball, 3 mm deep in it, looking at its centre.
physics::RigidPose on_top() {
  return {.position = {0, 0, kBall - 0.003}, .orientation = {0, 1, 0, 0}};
}

TEST(MovedOnSkin, SlidesAlongTheSlopeAtTheSameDepth) {
  const LabelVolume labels = ball();
  for (const auto& [lateral, elevation] : {std::pair{0.03, 0.0}, {0.0, -0.03}, {0.02, 0.025}, {0.0, 0.0}}) {
    const auto moved = moved_on_skin(on_top(), labels, {.lateral = lateral, .elevation = elevation});
    ASSERT_TRUE(moved);
    EXPECT_NEAR(moved->position.norm(), kBall - 0.003, 0.002) << "to a voxel";
    EXPECT_NEAR(moved->position.x(), lateral, 0.003);
    EXPECT_NEAR(moved->position.y(), -elevation, 0.003);  // the probe's +Y is the ball's -Y
    const Eigen::Vector3d axis = moved->orientation * Eigen::Vector3d::UnitZ();
    EXPECT_GT(axis.dot(-moved->position.normalized()), std::cos(0.07)) << "towards the centre, within 4 degrees";
  }
}

TEST(MovedOnSkin, TurnsAndPresses) {
  const LabelVolume labels = ball();
  const physics::RigidPose pose = on_top();
  const auto moved = moved_on_skin(pose, labels, {.press = 0.004, .tilt = 0.2});
  ASSERT_TRUE(moved);
  EXPECT_NEAR((moved->position - pose.position).z(), -0.004, 1e-6);
  // About the probe's own lateral axis, which stays.
  EXPECT_LT((moved->orientation * Eigen::Vector3d::UnitX() - pose.orientation * Eigen::Vector3d::UnitX()).norm(),
            1e-9);
  EXPECT_NEAR(moved->orientation.angularDistance(pose.orientation), 0.2, 1e-9);
}

TEST(MovedOnSkin, EndsWhereTheSkinDoes) {
  EXPECT_FALSE(moved_on_skin(on_top(), ball(), {.lateral = 0.099}));
}

TEST(AngleToBeam, IsMeasuredToTheBeamThatGoesThroughThePoint) {
  constexpr double kDegree = 0.017453292519943295;
  Probe probe;
  probe.pose = {.position = {0.1, 0.2, 0.3}, .orientation = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5)};
  const auto world = [&](const Eigen::Vector3d& v) { return Eigen::Vector3d(probe.pose.orientation * v); };
  // Beside the middle of the image, where the beam of a convex probe leans by 20 degrees.
  const double depth = 0.05, aside = (probe.radius + depth) * std::tan(20 * kDegree);
  const Eigen::Vector3d point = probe.pose.position + world({aside, 0, depth});
  for (const double lean : {-60.0, -20.0, 0.0, 20.0, 50.0}) {  // of the needle
    const Eigen::Vector3d needle = world({std::sin(lean * kDegree), 0, std::cos(lean * kDegree)});
    probe.convex = true;
    EXPECT_NEAR(angle_to_beam(probe, point, 0.03 * needle), std::abs(lean - 20) * kDegree, 1e-7) << lean;
    EXPECT_NEAR(angle_to_beam(probe, point, -needle), std::abs(lean - 20) * kDegree, 1e-7) << "from behind";
    probe.convex = false;
    EXPECT_NEAR(angle_to_beam(probe, point, needle), std::abs(lean) * kDegree, 1e-7) << lean;
  }
}

}  // namespace
}  // namespace stylet::content
