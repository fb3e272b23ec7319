// The probe pressed deep and fast: nothing turns inside out, the head keeps the body, the force grows with the depth.
#include "physics/loops/simulation_loop.h"

#include "physics/contact/probe_grip.h"
#include "physics/contact/probe_shape.h"
#include "tests/physics/contact_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stylet::physics {
namespace {

constexpr double kStep = 0.02;  // s

/// A block of 120 x 120 x 60 mm held at its foot, and the probe above the middle of it.
class Press {
public:
  /// @param young_modulus  of the block, Pa
  explicit Press(double young_modulus = tests::kYoung)
      : loop_(block(young_modulus), settings()), patch_(loop_.make_patch()) {}

  /// One step with the face `depth` below the top, turned by `angle` about the axis across the image, m, rad.
  const SimulationReport& at(double depth, double angle = 0) {
    const Eigen::Quaterniond down(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
    const RigidPose pose{{0, 0, 0.06 - depth}, down * Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis))};
    report_ = loop_.step({.time_s = kStep * static_cast<double>(++steps_), .probe = &pose}, patch_);
    loop_.worker().step();
    inverted += report_.inverted_tets;
    return report_;
  }
  double force() const { return report_.probe.wrench.force.z(); }
  const ProbeContact& probe() const { return report_.probe; }
  const SimulationLoop& loop() const { return loop_; }

  int inverted = 0;  // tetrahedra, summed over the steps
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();

private:
  static std::vector<SimulationBody> block(double young_modulus) {
    std::vector<SimulationBody> bodies(1);
    bodies[0].mesh = reference::kuhn_box({-0.06, -0.06, 0}, {0.06, 0.06, 0.06}, {12, 12, 6});
    bodies[0].tet_materials.assign(bodies[0].mesh.tets.size(), {young_modulus, 0.45});
    bodies[0].fixed_nodes = tests::at_height(bodies[0].mesh, 0);
    return bodies;
  }
  static SimulationLoopSettings settings() {
    SimulationLoopSettings settings{.dt = kStep, .lay_contacts = false};
    settings.contact.probe.emplace();
    return settings;
  }
  SimulationLoop loop_;
  TissuePatch patch_;
  SimulationReport report_;
  int steps_ = 0;
};

TEST(ProbePress, ForceGrowsToFortyMillimetresAndRestsTheSameAtAnySpeed) {
  double slow = 0;
  for (const double speed : {0.05, 0.2}) {
    Press press;
    double highest = 0, lost = 0;
    for (double depth = 0; depth < 0.04; depth += speed * kStep) {
      press.at(std::min(depth, 0.04));
      lost = std::max(lost, highest - press.force());
      highest = std::max(highest, press.force());
    }
    for (int i = 0; i < 60; ++i) press.at(0.04);
    const double rest = press.force();
    std::printf("[ %3.0f mm/s ] %.2f N at 40 mm, lost on the way %.3f N, %d inverted\n", 1e3 * speed, rest, lost,
                press.inverted);
    EXPECT_LT(lost, 0.01 * rest);
    EXPECT_GT(rest, 15);
    EXPECT_EQ(press.inverted, 0);
    if (slow == 0) slow = rest;
    EXPECT_NEAR(rest, slow, 0.01 * slow);  // the skin has come round the rims by another way
    // Lifted at the same speed.
    for (double depth = 0.04; depth > -0.02; depth -= speed * kStep) press.at(depth);
    for (int i = 0; i < 40; ++i) press.at(-0.02);
    EXPECT_EQ(press.force(), 0);
    EXPECT_EQ(press.inverted, 0);
    EXPECT_LT((press.loop().tissue().positions[0] - rest_positions(press.loop().model(0))).cwiseAbs().maxCoeff(),
              1e-6);
  }
}

TEST(ProbePress, TheHandIsToldTheStiffnessThatThePressingFinds) {
  Press press;
  for (int i = 0; i < 40; ++i) press.at(-0.001);
  EXPECT_TRUE(press.probe().near);
  EXPECT_NEAR(press.probe().gap, 0.001, 5e-5);  // to a point of the skin beside the face's middle
  EXPECT_EQ(press.probe().stiffness, 0);
  // Over a millimeter up and down: the force grows in small steps, as points of the skin come under the head.
  constexpr double kAround = 0.001;
  const auto force_at = [&](double depth) {
    for (int i = 0; i < 40; ++i) press.at(depth);
    return press.force();
  };
  for (const double depth : {0.002, 0.005, 0.010, 0.020}) {
    const double less = force_at(depth - kAround);
    const double here = force_at(depth);
    const double told = press.probe().stiffness;
    const double found = (force_at(depth + kAround) - less) / (2 * kAround);
    std::printf("[ %2.0f mm deep ] %.2f N, told %.0f N/m, found %.0f N/m\n", 1e3 * depth, here, told, found);
    EXPECT_NEAR(told, found, (depth < 0.015 ? 0.3 : 0.5) * found);  // W is that of the body at rest
  }
  for (int i = 0; i < 40; ++i) press.at(-0.02);
  EXPECT_FALSE(press.probe().near);
}

TEST(ProbePress, OnWhatHardlyGivesWayTheHandGivesWay) {
  const ProbeContactSettings settings;
  Press press(100 * tests::kYoung);
  double before = 0;
  for (int i = 1; i <= 50; ++i) {
    press.at(0.0004 * i);
    EXPECT_GE(press.force(), 0.98 * before);
    before = press.force();
  }
  for (int i = 0; i < 100; ++i) press.at(0.02);
  const double told = press.probe().stiffness;
  const double ratio = press.force() / settings.grip_force;
  const double law = settings.grip_yield * std::pow(ratio, 4);
  std::printf("[ 20 mm into stone ] %.3f N, the hand gave way by %.3f mm (law: %.3f), told %.0f N/m\n", press.force(),
              1e3 * press.probe().yielded, 1e3 * law, told);
  EXPECT_NEAR(press.probe().yielded, law, 1e-6);
  EXPECT_GT(press.probe().yielded, 0.01);
  // The hand is told the stiffness of both in series, never more than its own.
  EXPECT_LT(told, press.force() / (4 * law));
  for (int i = 0; i < 20; ++i) press.at(-0.01);
  EXPECT_EQ(press.force(), 0);
  EXPECT_EQ(press.probe().yielded, 0);
}

TEST(ProbeGrip, AForceThatIsNoNumberIsForgotten) {
  ProbeGrip grip(ProbeContactSettings{});
  const RigidPose held{{0, 0, 0.1}, Eigen::Quaterniond::Identity()};
  ProbeContact pressed;
  pressed.wrench.force = {0, 0, -50};
  pressed.stiffness = 1000;
  for (int i = 0; i < 100; ++i) {
    pressed.stiffness = 1000;
    grip.feel(grip.head(held), pressed);
  }
  const double law = 0.005 * std::pow(50.0 / 40, 4);
  EXPECT_NEAR(pressed.yielded, law, 1e-9);
  EXPECT_NEAR(grip.head(held).position.z(), 0.1 - law, 1e-9);
  for (const double mad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ProbeContact contact = pressed;
    contact.stiffness = mad;
    grip.feel(grip.head(held), contact);
    EXPECT_EQ(grip.head(held).position, held.position);
    contact = pressed;
    contact.stiffness = 1000;
    contact.wrench.force.z() = -mad;
    grip.feel(grip.head(held), contact);
    EXPECT_TRUE(grip.head(held).position.allFinite());
  }
}

TEST(ProbePress, RockingAndTiltingKeepTheBody) {
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(Eigen::Vector3d::UnitY()), Eigen::Vector3d(Eigen::Vector3d::UnitX())}) {
    Press press;
    press.axis = axis;
    for (int i = 1; i <= 20; ++i) press.at(0.001 * i);
    const double upright = press.force();
    double least = upright;
    for (int i = 1; i <= 50; ++i) {  // 20 degrees at 1 Hz
      press.at(0.02, M_PI / 9 * std::sin(2 * M_PI * kStep * i));
      least = std::min(least, press.force());
    }
    for (int i = 0; i < 40; ++i) press.at(0.02);
    std::printf("[ 20 degrees ] upright %.2f N, least %.2f N, afterwards %.2f N, %d inverted\n", upright, least,
                press.force(), press.inverted);
    EXPECT_EQ(press.inverted, 0);
    EXPECT_GT(least, 0.5 * upright);
    EXPECT_NEAR(press.force(), upright, 0.1 * upright);
  }
}

TEST(ProbeShape, APointDeepInTheHeadGoesBackTheWayItCame) {
  const ProbeShape head{.face_radius = 0, .half_width = 0.03, .half_height = 0.01, .length = 0.08, .rounding = 0.003};
  // 15 mm under the face, nearer to the sides than to it.
  const Eigen::Vector3d deep(0.002, 0.001, -0.015);
  EXPECT_NEAR(head.distance(deep).value, -0.009, 1e-12);
  EXPECT_EQ(head.entry({0.002, 0.001, 0.001}, deep), ProbeSide::face);
  EXPECT_NEAR(head.distance_from(ProbeSide::face, deep).value, -0.015, 1e-12);
  EXPECT_EQ(head.distance_from(ProbeSide::face, deep).gradient, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(head.entry({0.002, -0.011, -0.015}, deep), ProbeSide::minus_y);
  EXPECT_NEAR(head.distance_from(ProbeSide::minus_y, deep).value, -0.011, 1e-12);
  EXPECT_EQ(head.distance_from(ProbeSide::minus_y, deep).gradient, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(head.entry({0.031, 0.001, -0.010}, deep), ProbeSide::plus_x);
  // Over the edge: past the corner of face and side, the plane crossed last counts.
  EXPECT_EQ(head.entry({0, 0.012, 0.001}, {0, 0.0095, -0.010}), ProbeSide::plus_y);
  EXPECT_EQ(head.entry({0, 0.011, 0.020}, {0, 0.005, -0.002}), ProbeSide::face);
  // From the flat part of the face over its rim to the side the distance goes over without a jump.
  double before = head.distance_from(ProbeSide::face, {0, 0, -0.005}).value;
  for (double y = 0; y <= 0.01; y += 1e-5) {
    const double now = head.distance_from(ProbeSide::face, {0, y, -0.005}).value;
    EXPECT_NEAR(now, before, 5e-5);
    before = now;
  }
  EXPECT_NEAR(before, 0, 2e-5);
  // Outside nothing has changed.
  for (double y = -0.015; y <= 0.015; y += 1e-3) {
    for (double z = -0.02; z <= 0.002; z += 5e-4) {
      const ProbeShape::Distance distance = head.distance({0.01, y, z});
      if (distance.value < 0) continue;
      EXPECT_EQ(head.distance_from(ProbeSide::face, {0.01, y, z}).value, distance.value);
      EXPECT_EQ(head.distance_from(ProbeSide::plus_y, {0.01, y, z}).gradient, distance.gradient);
    }
  }
}

TEST(ProbeShape, TheWayOutTurnsOverTheRimWithoutAJump) {
  const ProbeShape head{.face_radius = 0, .half_width = 0.03, .half_height = 0.01, .length = 0.08, .rounding = 0.003};
  constexpr double kStride = 1e-6;  // m
  for (const ProbeSide side : {ProbeSide::face, ProbeSide::plus_y}) {
    double steepest = 0, longest = 0, wrong = 0, nearest = 0;
    for (double depth = -0.001; depth < 0.005; depth += 1e-4) {
      // A level below the rim: from the flat part of the face round the corner to that of the side.
      Eigen::Vector3d before = Eigen::Vector3d::Zero();
      for (double way = -0.008; way < 0.008; way += kStride) {
        const Eigen::Vector3d x(0, 0.01 - depth + std::min(way, 0.0), -depth - std::max(way, 0.0));
        const ProbeShape::Distance d = head.distance_from(side, x);
        if (!before.isZero()) steepest = std::max(steepest, (d.gradient - before).norm() / kStride);
        before = d.gradient;
        // As deep as the layer on the skin allows.
        if (d.value > -0.005) longest = std::max(longest, std::abs(d.gradient.norm() - 1));
        if (const double exact = head.distance(x).value; std::abs(exact) < 1e-5) {
          nearest = std::max(nearest, std::abs(d.value - exact));
        }
      }
      // No work is done over a closed path: what pushes is the gradient of a potential.
      for (double way = -0.0081; way < 0.008; way += 1e-4) {
        const Eigen::Vector3d x(0, 0.01 - depth + std::min(way, 0.0), -depth - std::max(way, 0.0));
        if (std::abs(head.distance(x).value) < 2 * kStride) continue;  // where (d.value)'' jumps
        for (int axis = 1; axis < 3; ++axis) {
          const Eigen::Vector3d step = kStride * Eigen::Vector3d::Unit(axis);
          const double slope =
              (head.distance_from(side, x + step).value - head.distance_from(side, x - step).value) / (2 * kStride);
          wrong = std::max(wrong, std::abs(slope - head.distance_from(side, x).gradient[axis]));
        }
      }
    }
    std::printf(
        "[ side %d ] the gradient turns by at most %.2f rad a mm, is off a unit by %.2f, off the slope by %.1e; "
        "0.01 mm from the surface the distance is off by %.1e m\n",
        static_cast<int>(side), 1e-3 * steepest, longest, wrong, nearest);
    EXPECT_LT(steepest, 4000);
    EXPECT_LT(longest, 4);
    EXPECT_LT(wrong, 1e-2);
    EXPECT_LT(nearest, 5e-7);
  }
}

}  // namespace
}  // namespace stylet::physics
