#include "haptic/feel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::haptic {
namespace {

using Eigen::Vector3d;

constexpr double kStep = 1e-3;  // s
const DeviceLimits kLimits{.renders_force = true};

TEST(Feel, TheSpringPullsBackFromEverywhere) {
  FeelModel spring(Feel::kSpring, kLimits);
  const Vector3d at(0.003, -0.004, 0.012);
  EXPECT_TRUE(spring.step(at, kStep).isApprox(-spring.stiffness() * at));
  EXPECT_TRUE(spring.step({0, 0, 0}, kStep).isZero(0));
  EXPECT_LE(spring.stiffness(), kLimits.max_stiffness_n_per_m);
}

TEST(Feel, TheWallPushesOutAndNeverHolds) {
  FeelModel wall(Feel::kWall, kLimits);
  double deepest = 0;
  for (int k = 0; k < 200; ++k) {  // 30 mm down and up again
    const double y = -0.030 * std::sin(std::numbers::pi * k / 199);
    const Vector3d force = wall.step({0, y, 0}, kStep);
    EXPECT_EQ(force.x(), 0);
    EXPECT_EQ(force.z(), 0);
    if (y > -FeelModel::kDepth) {
      EXPECT_EQ(force.y(), 0) << "outside it there is nothing";
    } else {
      EXPECT_GE(force.y(), kLimits.max_stiffness_n_per_m * (-y - FeelModel::kDepth) * (1 - 1e-12));
      deepest = std::max(deepest, force.y());
    }
  }
  EXPECT_GT(deepest, 4);
}

TEST(Feel, FrictionTakesEnergyWhateverTheHandDoes) {
  FeelModel friction(Feel::kFriction, kLimits);
  double taken = 0, largest = 0;
  Vector3d last = Vector3d::Zero(), force = friction.step(last, kStep);
  for (int k = 1; k < 5000; ++k) {
    const double t = k * kStep;
    const Vector3d at(0.02 * std::sin(7 * t), 0.01 * std::sin(11 * t), 0.015 * std::sin(5 * t));
    const Vector3d next = friction.step(at, kStep);
    taken -= 0.5 * (force + next).dot(at - last);
    EXPECT_GT(taken, -1e-9);
    largest = std::max(largest, next.norm());
    last = at;
    force = next;
  }
  EXPECT_NEAR(largest, friction.force(), 1e-9);
  EXPECT_GT(taken, 0.1 * friction.force());
}

TEST(Feel, TheSkinGivesWayOnceAndIsWholeAgainOutside) {
  FeelModel skin(Feel::kPuncture, kLimits);
  const auto down = [&] {
    double largest = 0, after = 0;
    for (int k = 0; k <= 400; ++k) {
      const double force = skin.step({0, -1e-4 * k, 0}, kStep).y();
      largest = std::max(largest, force);
      after = force;
    }
    EXPECT_NEAR(largest, skin.force(), 1e-4 * skin.stiffness());
    EXPECT_NEAR(after, skin.force() / 5, 1e-9) << "only the shaft rubs";
  };
  down();
  EXPECT_EQ(skin.punctures(), 1);
  EXPECT_LE(skin.step({0, -0.030, 0}, kStep).y(), 0) << "and it rubs on the way back";
  EXPECT_TRUE(skin.step({0, 0, 0}, kStep).isZero(0));
  down();
  EXPECT_EQ(skin.punctures(), 2);
}

}  // namespace
}  // namespace stylet::haptic
