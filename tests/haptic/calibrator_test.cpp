#include "haptic/hid/calibrator.h"

#include <gtest/gtest.h>

#include <random>

namespace stylet::haptic::hid {
namespace {

using Eigen::Vector3d;

/// A hand that does what it is asked, in a device frame that is turned on the desk; it trembles.
class CalibratorTest : public testing::Test {
protected:
  void hold(Calibrator& calibrator, const Vector3d& place, double seconds = 1.2) {
    std::uniform_real_distribution<double> tremor(-0.0005, 0.0005);
    HidReading reading{.in_range = true};
    const Vector3d from = hand;
    for (int k = 0; k < 200; ++k) {  // on its way
      hand = from + k / 200.0 * (place - from);
      reading.position = device_from_user * hand;
      calibrator.add(reading, time_s += 1e-3);
    }
    hand = place;
    for (double end = time_s + seconds; time_s < end; time_s += 1e-3) {
      reading.position = device_from_user * (hand + Vector3d(tremor(random), tremor(random), tremor(random)));
      calibrator.add(reading, time_s);
    }
  }
  /// Rest, and corners of a width and a depth, in the order of the prompts.
  void go_round(Calibrator& calibrator, double width, double depth) {
    hold(calibrator, kRest);
    for (const Vector3d& corner : {Vector3d(-1, 0, 1), Vector3d(1, 0, 1), Vector3d(1, 0, -1), Vector3d(-1, 0, -1)}) {
      hold(calibrator, kRest + Vector3d(corner.x() * width, 0, corner.z() * depth) / 2);
    }
  }
  void push(Calibrator& calibrator, const std::array<double, 6>& axes, double noise, double seconds) {
    std::uniform_real_distribution<double> any(-noise, noise);
    HidReading reading{.axes = axes};
    for (double end = time_s + seconds; time_s < end; time_s += 8e-3) {
      for (std::size_t k = 0; k < 6; ++k) reading.axes[k] = axes[k] + any(random);
      calibrator.add(reading, time_s);
    }
  }

  static inline const Vector3d kRest{0.01, 0.05, 0.02};
  Eigen::Quaterniond device_from_user = Eigen::Quaterniond::Identity();
  Vector3d hand = Vector3d::Zero();
  double time_s = 100;
  std::mt19937_64 random{7};
};

TEST_F(CalibratorTest, FindsRestPlaceTurnAndScaleOfAStylus) {
  device_from_user = Eigen::AngleAxisd(0.6, Vector3d::UnitY()) * Eigen::AngleAxisd(0.2, Vector3d::UnitX());
  Calibrator calibrator(DeviceKind::kStylus);
  EXPECT_NE(calibrator.prompt().find("rest place"), std::string::npos);
  go_round(calibrator, 0.12, 0.10);
  ASSERT_TRUE(calibrator.done()) << calibrator.prompt();
  EXPECT_EQ(calibrator.prompt(), "");
  const Calibration found = calibrator.result();
  ASSERT_TRUE(found.rest);
  EXPECT_LT((*found.rest - device_from_user * kRest).norm(), 0.001);
  EXPECT_LT(found.user_from_device.angularDistance(device_from_user.conjugate()), 0.02);
  EXPECT_NEAR(found.scale, 0.15 / 0.10, 0.03);
  EXPECT_FALSE(found.dead_zone);
}

TEST_F(CalibratorTest, WideReachIsNotScaledDownAndASmallOneOnlyFourTimes) {
  for (const auto& [size, scale] : {std::pair{0.4, 1.0}, std::pair{0.033, 4.0}}) {
    Calibrator calibrator(DeviceKind::kStylus, {.apart_m = 0.015});
    go_round(calibrator, size, size);
    ASSERT_TRUE(calibrator.done());
    EXPECT_EQ(calibrator.result().scale, scale);
  }
}

TEST_F(CalibratorTest, WaitsForAHandThatMovesOrComesToNoNewPlace) {
  Calibrator calibrator(DeviceKind::kStylus);
  hold(calibrator, kRest);
  const std::string corner = calibrator.prompt();
  hold(calibrator, kRest, 5);  // still at the place before
  EXPECT_EQ(calibrator.prompt(), corner);
  HidReading reading{.position = {0.2, 0, 0}, .in_range = true};
  for (int k = 0; k < 5000; ++k, time_s += 1e-3) {  // 10 mm/s
    reading.position.x() += 1e-5;
    ASSERT_FALSE(calibrator.add(reading, time_s));
  }
  reading.in_range = false;
  for (int k = 0; k < 3000; ++k) ASSERT_FALSE(calibrator.add(reading, time_s += 1e-3));
  EXPECT_EQ(calibrator.prompt(), corner);
}

TEST_F(CalibratorTest, RefusesCornersThatAreNone) {
  const auto problem = [&](std::initializer_list<Vector3d> places) -> std::string {
    Calibrator calibrator(DeviceKind::kStylus);
    for (const Vector3d& place : places) hold(calibrator, place);
    EXPECT_TRUE(calibrator.done());
    try {
      calibrator.result();
    } catch (const CalibrationError& error) {
      return error.what();
    }
    return {};
  };
  const Vector3d rest(0, 0.1, 0);
  EXPECT_NE(problem({rest, {-0.1, 0, 0.1}, {0.1, 0, 0.1}, {-0.1, 0, -0.1}, {0.1, 0, -0.1}}).find("no rectangle"),
            std::string::npos);
  EXPECT_NE(problem({rest, {0, 0, 0}, {0.05, 0, 0}, {0.1, 0, 0}, {0.15, 0, 0}}).find("no rectangle"),
            std::string::npos);
  EXPECT_NE(problem({rest, {0.1, 0, 0.1}, {-0.1, 0, 0.1}, {-0.1, 0, -0.1}, {0.1, 0, -0.1}}).find("changed places"),
            std::string::npos);
}

TEST_F(CalibratorTest, SpaceMouseAtRestGivesItsCentreAndDeadZones) {
  Calibrator calibrator(DeviceKind::kSpaceMouse);
  push(calibrator, {}, 0.01, 3);  // nobody has touched it
  EXPECT_FALSE(calibrator.done());
  push(calibrator, {0.8, 0, 0, 0, 0, 0}, 0.01, 0.5);
  push(calibrator, {0.04, 0, 0, 0, 0, -0.06}, 0.05, 2);
  ASSERT_TRUE(calibrator.done()) << calibrator.prompt();
  const Calibration found = calibrator.result();
  ASSERT_TRUE(found.centre && found.dead_zone);
  EXPECT_FALSE(found.rest);
  EXPECT_NEAR((*found.centre)[0], 0.04, 0.01);
  EXPECT_NEAR((*found.centre)[5], -0.06, 0.01);
  for (const double zone : *found.dead_zone) EXPECT_NEAR(zone, 1.5 * 0.05, 0.01);
}

TEST_F(CalibratorTest, PensGoToTheirCornersAndJoysticksRest) {
  Calibrator pen(DeviceKind::kPen);
  for (const Vector3d& corner : {Vector3d(-1, 0, 1), Vector3d(1, 0, 1), Vector3d(1, 0, -1), Vector3d(-1, 0, -1)}) {
    hold(pen, 0.1 * corner);
  }
  ASSERT_TRUE(pen.done());
  EXPECT_FALSE(pen.result().rest);
  EXPECT_EQ(pen.result().scale, 1);
  Calibrator stick(DeviceKind::kJoystick);
  hold(stick, {0.02, 0, 0});
  ASSERT_TRUE(stick.done());
  EXPECT_NEAR(stick.result().rest->x(), 0.02, 0.001);
  EXPECT_TRUE(Calibrator(DeviceKind::kUnusable).done());
}

}  // namespace
}  // namespace stylet::haptic::hid
