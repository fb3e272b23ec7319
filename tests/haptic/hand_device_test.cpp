// A tracked hand as a stylus.
#include "haptic/hand_device.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace stylet::haptic {
namespace {

const HandSettings kSettings{
    .start = {0.1, 0.2, 0.3},
    .start_orientation = Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, -1).normalized()))};

/// Reads at 1 kHz until what was asked for is reached.
StylusSample settled(HandDevice& device, double& now_s) {
  StylusSample sample;
  for (int i = 0; i < 300; ++i) sample = device.read(now_s += 0.001);
  return sample;
}

TEST(HandDevice, WaitsAtItsStartUntilTheHandTakesItUp) {
  HandDevice device(kSettings);
  double now_s = 0;
  EXPECT_EQ(device.read(0).position, kSettings.start);
  device.follow({5, 5, 5}, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())));
  const StylusSample sample = settled(device, now_s);
  EXPECT_TRUE(sample.valid);
  EXPECT_TRUE(sample.position.isApprox(kSettings.start, 1e-12)) << "wherever the hand is then";
  EXPECT_NEAR(sample.orientation.angularDistance(kSettings.start_orientation), 0, 1e-7);
}

TEST(HandDevice, MovesAndTurnsAsTheHandDoes) {
  HandDevice device(kSettings);
  double now_s = 0;
  const Eigen::Quaterniond held(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-2.5, Eigen::Vector3d(0, 1, 1).normalized()));
  device.follow({1, 1, 1}, held);
  device.follow({1.02, 0.97, 1.01}, turn * held);
  const StylusSample sample = settled(device, now_s);
  EXPECT_TRUE(sample.position.isApprox(kSettings.start + Eigen::Vector3d(0.02, -0.03, 0.01), 1e-9));
  EXPECT_NEAR(sample.orientation.angularDistance(turn * kSettings.start_orientation), 0, 1e-6);
}

TEST(HandDevice, ReleasedItStaysAndGraspedElsewhereItDoesNotJump) {
  HandDevice device(kSettings);
  double now_s = 0;
  const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
  device.follow({0, 0, 0}, level);
  device.follow({0.01, 0, 0}, level);
  device.release();
  device.follow({0.5, 0.5, 0.5}, level);
  EXPECT_TRUE(settled(device, now_s).position.isApprox(kSettings.start + Eigen::Vector3d(0.01, 0, 0), 1e-9));
  device.follow({0.5, 0.5, 0.52}, level);
  EXPECT_TRUE(settled(device, now_s).position.isApprox(kSettings.start + Eigen::Vector3d(0.01, 0, 0.02), 1e-9));
  device.follow({0, std::numeric_limits<double>::quiet_NaN(), 0}, level);
  EXPECT_TRUE(settled(device, now_s).position.isApprox(kSettings.start + Eigen::Vector3d(0.01, 0, 0.02), 1e-9));
}

TEST(HandDevice, MakesTheHeadsetsStepsSmooth) {
  // 0.2 m/s and 1 rad/s in steps of 90 Hz, read at 1 kHz.
  HandDevice device(kSettings);
  StylusSample last = device.read(0);
  double largest = 0, largest_turn = 0;
  for (int ms = 1; ms <= 500; ++ms) {
    const double frame_s = std::floor(ms * 0.090) / 90;
    device.follow({0.2 * frame_s, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(frame_s, Eigen::Vector3d::UnitZ())));
    const StylusSample sample = device.read(ms * 1e-3);
    largest = std::max(largest, (sample.position - last.position).norm());
    largest_turn = std::max(largest_turn, sample.orientation.angularDistance(last.orientation));
    last = sample;
  }
  // As they come they would be 2.2 mm and 11 mrad in one millisecond.
  EXPECT_LT(largest, 2 * 0.2e-3);
  EXPECT_LT(largest_turn, 2 * 1e-3);
  // Behind by the two time constants, and by the mean age of a frame.
  EXPECT_NEAR(last.position.x() - kSettings.start.x(), 0.2 * (0.5 - 0.02 - 0.0055), 0.2 * 0.006);
}

TEST(HandDevice, PassesButtonsOnAndRejectsInvalidPoses) {
  HandDevice device(kSettings);
  device.press(1);
  EXPECT_EQ(device.read(0).buttons, 1U);
  EXPECT_FALSE(device.limits().renders_force);
  EXPECT_THROW(HandDevice({.smoothing_s = 0}), std::invalid_argument);
  EXPECT_THROW(HandDevice({.start = {0, NAN, 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace stylet::haptic
