// The stylus that is tracked elsewhere: smooth, never too fast, and still when nothing is heard.
#include "engine/link/link_stylus.h"

#include <gtest/gtest.h>

namespace stylet::link {
namespace {

TEST(LinkStylus, WaitsAtItsStartUntilAPoseComes) {
  LinkStylus stylus({.position = {0, 0, 0.2}});
  for (int step = 0; step < 50; ++step) {
    const haptic::StylusSample sample = stylus.read(1e-3 * step);
    EXPECT_FALSE(sample.valid);
    EXPECT_EQ(sample.position, Eigen::Vector3d(0, 0, 0.2));
  }
}

TEST(LinkStylus, IsNotValidATenthOfASecondAfterTheLastPoseAndStays) {
  LinkStylus stylus({});
  stylus.follow({.position = {0.001, 0, 0}});
  int valid = 0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int step = 0; step < 1000; ++step) {
    const haptic::StylusSample sample = stylus.read(1e-3 * step);
    EXPECT_TRUE(sample.valid || valid == 0 || sample.position == last);
    valid += sample.valid ? 1 : 0;
    last = sample.position;
  }
  EXPECT_NEAR(valid, 101, 1);
}

TEST(LinkStylus, FollowsPosesOfFiftyHertzSmoothly) {
  // 20 mm/s in steps of 0.4 mm: the speed that comes out has settled to within a few per cent, without steps.
  LinkStylus stylus({});
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int step = 0; step < 1000; ++step) {
    if (step % 20 == 0) stylus.follow({.position = {0, 0, 20e-6 * step}});
    const haptic::StylusSample sample = stylus.read(1e-3 * step);
    EXPECT_TRUE(sample.valid);
    const double speed = (sample.position - last).norm() / 1e-3;
    if (step > 300) {
      EXPECT_NEAR(speed, 0.020, 0.2 * 0.020);
    }
    last = sample.position;
  }
  // Two low-passes of 20 ms and half a period of the tracker behind.
  EXPECT_NEAR(last.z(), 20e-6 * (1000 - 40 - 10), 0.4e-3);
}

TEST(LinkStylus, AJumpOfTheTrackerIsAMotionOfBoundedSpeed) {
  LinkStylus stylus({});
  physics::RigidPose there{.position = {0.3, 0, 0}};
  there.orientation = Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY());
  haptic::StylusSample last = stylus.read(0);
  for (int step = 1; step <= 1500; ++step) {
    if (step % 20 == 0) stylus.follow(there);
    const haptic::StylusSample sample = stylus.read(1e-3 * step);
    EXPECT_LE((sample.position - last.position).norm(), 1.001e-3 * LinkStylus::kFastest);
    EXPECT_LE(sample.orientation.angularDistance(last.orientation), 1.001e-3 * LinkStylus::kFastestTurn);
    last = sample;
  }
  EXPECT_LT((last.position - there.position).norm(), 1e-5);
  EXPECT_LT(last.orientation.angularDistance(there.orientation), 1e-3);
}

}  // namespace
}  // namespace stylet::link
