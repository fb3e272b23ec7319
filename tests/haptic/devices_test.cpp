#include "haptic/mouse_device.h"
#include "haptic/recorded_device.h"
#include "haptic/scripted_device.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace stylet::haptic {
namespace {

StylusSample sample_at(double time_s, const Eigen::Vector3d& position, double angle = 0, std::uint32_t buttons = 0) {
  StylusSample s;
  s.time_s = time_s;
  s.position = position;
  s.orientation = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized());
  s.buttons = buttons;
  s.valid = true;
  return s;
}

/// Largest jump of the velocity over `at`, by one-sided differences whose own error vanishes with `h`.
double velocity_jump(Device& device, double at, double h) {
  const Eigen::Vector3d before = (device.read(at).position - device.read(at - h).position) / h;
  const Eigen::Vector3d after = (device.read(at + h).position - device.read(at).position) / h;
  return (after - before).norm();
}

double spin_jump(Device& device, double at, double h) {
  const auto spin = [&](double t0, double t1) {
    const Eigen::AngleAxisd turn(device.read(t0).orientation.inverse() * device.read(t1).orientation);
    return Eigen::Vector3d(turn.axis() * (turn.angle() / h));
  };
  return (spin(at, at + h) - spin(at - h, at)).norm();
}

std::vector<StylusSample> zigzag() {
  return {sample_at(1.0, {0, 0, 0}, 0.0),           sample_at(1.2, {0.01, 0, 0.02}, 0.5),
          sample_at(1.3, {0.02, 0.01, 0}, 1.4),     sample_at(1.7, {0.05, 0.01, 0.01}, 0.2),
          sample_at(1.8, {0.05, -0.01, 0.03}, 0.3), sample_at(2.5, {0.02, 0, 0.04}, -2.0)};
}

TEST(RecordedDevice, PassesThroughItsSamples) {
  RecordedDevice device(zigzag());
  for (const StylusSample& s : zigzag()) {
    const StylusSample read = device.read(s.time_s);
    EXPECT_LE((read.position - s.position).norm(), 1e-15);
    EXPECT_LE(read.orientation.angularDistance(s.orientation), 1e-7);  // arccos near 1: half the digits
    EXPECT_TRUE(read.valid);
  }
}

TEST(RecordedDevice, IsContinuouslyDifferentiableEverywhere) {
  RecordedDevice device(zigzag());
  // At a kink the jump stays as h shrinks; where the derivative is continuous it shrinks with h. Include both ends.
  for (const StylusSample& s : zigzag()) {
    const double coarse = velocity_jump(device, s.time_s, 1e-4);
    const double fine = velocity_jump(device, s.time_s, 1e-6);
    EXPECT_LE(fine, 1e-4) << s.time_s;  // m/s, with speeds of 0.1 m/s
    EXPECT_LE(fine, 0.1 * coarse + 1e-8) << s.time_s;
    EXPECT_LE(spin_jump(device, s.time_s, 1e-5), 0.01) << s.time_s;  // rad/s, with spins of 10 rad/s
  }
}

TEST(RecordedDevice, NeverLeavesTheRangeOfTheTwoSamplesAround) {
  RecordedDevice device(zigzag());
  const std::vector<StylusSample> track = zigzag();
  for (std::size_t i = 0; i + 1 < track.size(); ++i) {
    const Eigen::Array3d low = track[i].position.cwiseMin(track[i + 1].position).array() - 1e-15;
    const Eigen::Array3d high = track[i].position.cwiseMax(track[i + 1].position).array() + 1e-15;
    for (int k = 0; k <= 200; ++k) {
      const double t = track[i].time_s + (track[i + 1].time_s - track[i].time_s) * k / 200.0;
      const Eigen::Array3d p = device.read(t).position.array();
      ASSERT_TRUE((p >= low).all() && (p <= high).all()) << t;
    }
  }
}

TEST(RecordedDevice, RestsBeforeTheFirstAndAfterTheLastSample) {
  RecordedDevice device(zigzag());
  EXPECT_EQ(device.read(-100).position, device.read(1.0).position);
  EXPECT_EQ(device.read(1e9).position, device.read(2.5).position);
  EXPECT_EQ(device.start_s(), 1.0);
  EXPECT_EQ(device.end_s(), 2.5);
}

TEST(RecordedDevice, ButtonsAreThoseOfTheLatestSample) {
  RecordedDevice device(
      {sample_at(0, {0, 0, 0}, 0, 1), sample_at(1, {0, 0, 1}, 0, 6), sample_at(2, {0, 0, 2}, 0, 0)});
  EXPECT_EQ(device.read(-1).buttons, 1u);
  EXPECT_EQ(device.read(0.999).buttons, 1u);
  EXPECT_EQ(device.read(1.0).buttons, 6u);
  EXPECT_EQ(device.read(5.0).buttons, 0u);
}

TEST(RecordedDevice, ErrorFallsAsTheSquareOfTheSampleDistanceAtLeast) {
  // A smooth motion, read away from its extrema of position, where the monotone slopes are of lower order.
  const auto truth = [](double t) { return Eigen::Vector3d(std::exp(0.3 * t), t * t, std::sin(0.3 * t)); };
  const auto error_with = [&](double h) {
    std::vector<StylusSample> track;
    for (int i = 0; i * h <= 4.0 + 1e-9; ++i) track.push_back(sample_at(i * h, truth(i * h), 0.3 * i * h));
    RecordedDevice device(track);
    double worst = 0;
    for (double t = 1.0; t < 3.0; t += 0.00317) worst = std::max(worst, (device.read(t).position - truth(t)).norm());
    return worst;
  };
  const double order = std::log2(error_with(0.1) / error_with(0.05));
  EXPECT_GE(order, 2.0);
}

TEST(RecordedDevice, TurnsTheShortWayWhenTheSignOfAQuaternionFlips) {
  std::vector<StylusSample> track{sample_at(0, {0, 0, 0}, 0.1), sample_at(1, {0, 0, 0}, 0.3)};
  track[1].orientation.coeffs() *= -1;
  RecordedDevice device(track);
  EXPECT_NEAR(device.read(0.5).orientation.angularDistance(track[0].orientation), 0.1, 1e-3);
}

TEST(RecordedDevice, RefusesATrackItCannotPlay) {
  const double nan = std::nan("");
  const auto message = [](std::vector<StylusSample> track) -> std::string {
    try {
      RecordedDevice device(std::move(track));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(message({}).find("empty"), std::string::npos);
  EXPECT_NE(message({sample_at(0, {0, 0, 0}), sample_at(0, {0, 0, 1})}).find("sample 1"), std::string::npos);
  EXPECT_NE(message({sample_at(0, {0, nan, 0})}).find("not finite"), std::string::npos);
  StylusSample zero = sample_at(0, {0, 0, 0});
  zero.orientation.coeffs().setZero();
  EXPECT_NE(message({zero}).find("zero quaternion"), std::string::npos);
}

Eigen::Vector3d tip(const StylusSample& s, double length) {
  return s.position + s.orientation * Eigen::Vector3d(0, 0, length);
}

TEST(ScriptedDevice, TipGoesFromTheSkinToTheTarget) {
  ScriptedMotion motion;
  motion.entry = {0.05, 0.1, 0.02};
  motion.target = {0.01, 0.08, -0.06};
  motion.bevel = {0, 1, 0.3};
  ScriptedDevice device(motion);
  const Eigen::Vector3d axis = (motion.target - motion.entry).normalized();
  const auto depth = [&](double t) { return (tip(device.read(t), motion.needle_length) - motion.entry).dot(axis); };
  const double length = (motion.target - motion.entry).norm();
  EXPECT_LT(depth(0), -0.02);                          // before the skin
  EXPECT_NEAR(depth(0.15 * 12), 0, 1e-12);             // at the entry
  EXPECT_NEAR(depth(0.53 * 12), 0.8 * length, 1e-12);  // at the end of the first insertion
  EXPECT_NEAR(depth(0.70 * 12), 0.4 * length, 1e-12);  // withdrawn
  EXPECT_LE((tip(device.read(12), motion.needle_length) - motion.target).norm(), 1e-12);
  EXPECT_EQ(device.read(20).position, device.read(12).position);
  const Eigen::Matrix3d r = device.read(3).orientation.toRotationMatrix();
  EXPECT_LE((r.col(2) - axis).norm(), 1e-12);  // +Z from hub to tip
  EXPECT_GT(r.col(0).dot(motion.bevel), 0);    // +X the bevel normal
}

TEST(ScriptedDevice, SwingsToBothSidesOnceDuringTheFirstInsertion) {
  ScriptedMotion motion;
  motion.lateral_amplitude = 0.010;
  ScriptedDevice device(motion);
  double most = 0, least = 0;
  for (double t = 0; t <= 12; t += 1e-3) {
    const double lateral = device.read(t).position.x();  // default: the bevel normal is x, the needle along -z
    most = std::max(most, lateral);
    least = std::min(least, lateral);
    if (t < 0.15 * 12 || t > 0.50 * 12) {
      ASSERT_NEAR(lateral, 0, 1e-12) << t;
    }
  }
  EXPECT_NEAR(most, 0.010, 1e-6);
  EXPECT_NEAR(least, -0.010, 1e-6);
}

TEST(ScriptedDevice, MovesWithoutKinks) {
  ScriptedDevice device{ScriptedMotion{}};
  double worst = 0;  // second difference = acceleration h^2: bounded, so no kink (which would be speed times h)
  const double h = 1e-3;
  for (double t = 0; t <= 12.5; t += h) {
    const Eigen::Vector3d bend =
        device.read(t + h).position - 2 * device.read(t).position + device.read(t - h).position;
    worst = std::max(worst, bend.norm());
  }
  EXPECT_LE(worst / (h * h), 0.5);  // m/s^2; a kink of 10 mm/s would show as 10
  EXPECT_GT(worst / (h * h), 0.01);
}

TEST(ScriptedDevice, RefusesAnImpossibleMotion) {
  const auto refused = [](const std::function<void(ScriptedMotion&)>& spoil) {
    ScriptedMotion motion;
    spoil(motion);
    EXPECT_THROW(ScriptedDevice{motion}, std::invalid_argument);
  };
  refused([](ScriptedMotion& m) { m.target = m.entry; });
  refused([](ScriptedMotion& m) { m.bevel = m.target - m.entry; });
  refused([](ScriptedMotion& m) { m.duration_s = 0; });
  refused([](ScriptedMotion& m) { m.depth.clear(); });
  refused([](ScriptedMotion& m) { m.depth[1].time_fraction = 0.9; });
}

TEST(MouseDevice, JumpOfTheMouseBecomesASmoothMotion) {
  MouseWorkspace workspace;
  workspace.smoothing_s = 0.04;
  MouseDevice mouse(workspace);
  const double start = mouse.read(0).position.z();
  mouse.advance(0.010);
  double last = start, last_speed = 0, fastest_change = 0;
  for (int i = 1; i <= 1000; ++i) {
    const double z = mouse.read(i * 1e-3).position.z();
    const double speed = (z - last) / 1e-3;
    fastest_change = std::max(fastest_change, std::abs(speed - last_speed));
    ASSERT_LE(z, last + 1e-15) << i;  // forward is -z, and it never swings back
    last = z;
    last_speed = speed;
  }
  EXPECT_NEAR(last, start - 0.010, 1e-9);
  // Greatest acceleration of two low-passes after a step A: A / T^2; one low-pass alone would jump by A / T in speed.
  EXPECT_LE(fastest_change, 0.010 / (0.04 * 0.04) * 1e-3 * 1.05);
}

TEST(MouseDevice, StaysInItsWorkspace) {
  MouseWorkspace workspace;
  MouseDevice mouse(workspace);
  mouse.read(0);
  mouse.move(5, -5);
  mouse.advance(5);
  mouse.move(std::nan(""), 0);
  const StylusSample s = mouse.read(100);
  const StylusSample settled = mouse.read(200);
  EXPECT_LE((settled.position - workspace.entry).cwiseAbs().maxCoeff(), 0.2);
  EXPECT_NEAR(settled.position.x(), workspace.max_lateral, 1e-12);
  EXPECT_NEAR(tip(settled, workspace.needle_length).z(), -workspace.max_depth, 1e-12);
  EXPECT_TRUE(s.position.allFinite());
}

TEST(MouseDevice, TiltsAboutTheSkinAndTurnsAboutItsAxis) {
  MouseWorkspace workspace;
  workspace.entry = {0.1, 0.2, 0.3};
  workspace.start_depth = -0.02;
  MouseDevice mouse(workspace);
  double now_s = 0;
  const auto settled = [&] {  // through one low-pass, then the other
    mouse.read(now_s += 10);
    return mouse.read(now_s += 10);
  };
  const StylusSample before = settled();
  mouse.tilt(0.3, 0);
  const StylusSample right = settled();
  const Eigen::Vector3d axis = right.orientation * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(std::acos(axis.dot(workspace.axis)), 0.3, 1e-9);
  EXPECT_GT((right.position - before.position).dot(workspace.right), 0.04);  // (150 + 20) mm sin 0.3
  // The line of the needle still goes through the entry.
  EXPECT_LT((workspace.entry - right.position).cross(axis).norm(), 1e-12);
  mouse.tilt(-0.3, 0.2);
  const Eigen::Vector3d up = workspace.axis.cross(workspace.right);
  EXPECT_GT((settled().position - before.position).dot(up), 0.03);
  mouse.tilt(0, -0.2);
  mouse.twist(0.5);
  const StylusSample turned = settled();
  EXPECT_LT((turned.position - before.position).norm(), 1e-9);
  const Eigen::AngleAxisd turn(turned.orientation * before.orientation.conjugate());
  EXPECT_NEAR(turn.angle(), 0.5, 1e-9);
  EXPECT_NEAR(turn.axis().dot(workspace.axis), 1, 1e-9);
  mouse.tilt(100, 0);
  const Eigen::Vector3d most = settled().orientation * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(std::acos(most.dot(workspace.axis)), workspace.max_tilt, 1e-9);
}

TEST(MouseDevice, PassesButtonsOn) {
  MouseDevice mouse{MouseWorkspace{}};
  EXPECT_EQ(mouse.read(0).buttons, 0u);
  mouse.press(5);
  EXPECT_EQ(mouse.read(0.001).buttons, 5u);
}

}  // namespace
}  // namespace stylet::haptic
