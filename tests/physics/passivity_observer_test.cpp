// The observer sees energy that is made long after an insertion has taken more than that.
#include "physics/loops/passivity_observer.h"

#include "tests/support/allocation_count.h"
#include "tools/reference/two_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace stylet::physics {
namespace {

constexpr double kDt = 1e-3;

/// A hand that goes along z against a force that depends on where it is and how it got there.
struct Hand {
  PassivityObserver observer{{.step_s = kDt}};
  NeedleState needle;
  StylusPose hub;
  double time = 0;

  /// @param force_on_hand  N, along z, at the place and time after the step
  void go(double z, double force_on_hand) {
    const Eigen::Vector3d force(0, 0, force_on_hand);
    needle.hand_work -= 0.5 * (needle.wrench.force + force).z() * (z - hub.position.z());
    hub.position.z() = z;
    needle.wrench.force = force;
    time += kDt;
    observer.add(time, hub, needle);
  }
  /// To and fro about `middle` for `cycles` of 1 s, beginning in the middle on the way in.
  void swing(double middle, double amplitude, int cycles, const std::function<double(double z, double v)>& force) {
    const int steps = static_cast<int>(std::lround(cycles / kDt));
    for (int i = 1; i <= steps; ++i) {
      const double phase = 2 * std::numbers::pi * i * kDt;
      const double z = middle + amplitude * std::sin(phase);
      go(z, force(z, amplitude * 2 * std::numbers::pi * std::cos(phase)));
    }
  }
};

TEST(PassivityObserver, SpringAndFrictionAreOneThingAndMadeEnergyAnother) {
  // 100 N/m: a cycle is nothing. Viscous b = 2 N s/m takes b w pi A^2 a cycle; b = -0.5 gives it, however much an
  // insertion has taken before, which is why the least work since the start stays at 0.
  const double amplitude = 0.004, w = 2 * std::numbers::pi;
  const auto a_cycle = [&](double b) { return b * w * std::numbers::pi * amplitude * amplitude; };
  Hand hand;
  for (int i = 1; i <= 1000; ++i) hand.go(1e-4 * i, -2);  // 0.2 J for the way in
  hand.swing(0.1, amplitude, 5, [](double z, double) { return -100 * (z - 0.1); });
  EXPECT_GE(hand.observer.summary().cycles, 4U);
  EXPECT_NEAR(hand.observer.summary().least_cycle.work, 0, 1e-9);
  hand.swing(0.1, amplitude, 5, [](double z, double v) { return -100 * (z - 0.1) - 2 * v; });
  EXPECT_NEAR(hand.observer.summary().least_cycle.work, 0, 1e-9);
  const double begin = hand.time;
  hand.swing(0.1, amplitude, 5, [](double z, double v) { return -100 * (z - 0.1) + 0.5 * v; });
  const PassivitySummary& summary = hand.observer.summary();
  EXPECT_GT(hand.needle.hand_work, 0.1) << "least_work_j sees nothing";
  EXPECT_NEAR(summary.least_cycle.work, a_cycle(-0.5), 1e-3 * a_cycle(0.5));
  EXPECT_NEAR(summary.least_cycle.stroke, 2 * amplitude, 1e-5);
  EXPECT_NEAR(summary.least_cycle.to_s - summary.least_cycle.from_s, 1, 0.01);
  EXPECT_GE(summary.least_cycle.from_s, begin - 0.3);
  EXPECT_GE(summary.cycles, 13U);
  // A window of 1 s over a whole cycle has what the cycle made.
  EXPECT_LE(summary.least_window.work, a_cycle(-0.5) * 0.99);
}

TEST(PassivityObserver, CyclesWithinACycleAreJudgedEachForItself) {
  // In by 20 mm with 1 N of friction, a small frictionless to and fro at half way, on, and out: the small one closes
  // with zero, the large one with twice the friction of its way.
  Hand hand;
  hand.go(0, 0);
  const auto drag = [&](double to, double friction) {
    const double from = hand.hub.position.z();
    const int steps = static_cast<int>(std::lround(std::abs(to - from) / 2e-5));
    for (int i = 1; i <= steps; ++i) hand.go(from + (to - from) * i / steps, to > from ? -friction : friction);
  };
  drag(0.010, 1);
  drag(0.008, 0);
  drag(0.010, 0);
  drag(0.020, 1);
  EXPECT_EQ(hand.observer.summary().cycles, 1U);
  EXPECT_NEAR(hand.observer.summary().least_cycle.stroke, 0.002, 1e-4);
  EXPECT_NEAR(hand.observer.summary().least_cycle.work, 0, 5e-5) << "friction rises at its ends within a step";
  drag(0, 1);
  drag(-0.001, 0);
  EXPECT_EQ(hand.observer.summary().cycles, 2U);
  EXPECT_EQ(hand.observer.summary().open, 0U);
}

TEST(PassivityObserver, ACycleThatEndsElsewhereIsNotJudged) {
  Hand hand;
  hand.go(0, 0);
  for (int i = 1; i <= 500; ++i) {
    hand.hub.position.x() = 1e-5 * i;  // 5 mm aside meanwhile
    hand.go(0.01 * std::sin(std::numbers::pi * i / 500), -1);
  }
  for (int i = 1; i <= 100; ++i) hand.go(-1e-5 * i, -1);
  EXPECT_EQ(hand.observer.summary().cycles, 0U);
  EXPECT_EQ(hand.observer.summary().open, 1U);
}

TEST(PassivityObserver, ManyEverSmallerSwingsForgetTheLargestOnly) {
  // 300 reversals of a decaying swing, more than there are places, then one way out closes those kept.
  Hand hand;
  hand.go(0, 0);
  double z = 0;
  const auto go_to = [&](double to) {
    const int steps = static_cast<int>(std::ceil(std::abs(to - z) / 5e-4));
    for (int i = 1; i <= steps; ++i) hand.go(z + (to - z) * i / steps, 0);
    z = to;
  };
  for (int k = 0; k < 300; ++k) go_to((k % 2 == 0 ? 1 : -1) * (0.2 - 6e-4 * k));
  EXPECT_EQ(hand.observer.summary().cycles, 1U) << "back to the start";
  const ::stylet::tests::AllocationCount allocations;
  go_to(-0.3);
  EXPECT_EQ(allocations.value(), 0);
  EXPECT_EQ(hand.observer.summary().cycles, 1U + 32U) << "of 64 places, two a cycle";
}

TEST(PassivityObserver, SeesASpringThatAnswersLate) {
  // What a contact at low rate is like: k x(t - tau) makes k pi A^2 sin(w tau) a cycle, pi/2 sin(w tau) of peak force
  // times stroke.
  const double amplitude = 0.003, w = 2 * std::numbers::pi, late = 0.006;
  Hand hand;
  for (int i = 1; i <= 500; ++i) hand.go(1e-4 * i, -2);
  hand.swing(0.05, amplitude, 4, [&](double z, double v) {
    return -300 * ((z - 0.05) * std::cos(w * late) - v / w * std::sin(w * late));
  });
  const double share = -std::numbers::pi / 2 * std::sin(w * late);
  EXPECT_NEAR(hand.observer.summary().least_cycle.share(), share, 0.01 * std::abs(share));
}

TEST(PassivityObserver, FindsNoEnergyFromOneBlock) {
  // As a session would see the rig of two_blocks_test.cpp: force and hub of the loop, nothing else.
  reference::TwoBlocks blocks({.frequency_hz = 2, .latency_s = 0.008, .one_body = true});
  PassivityObserver observer({.step_s = kDt});
  for (int i = 0; i < 2500; ++i) {
    blocks.step();
    observer.add(blocks.time_s(), blocks.hub(), blocks.needle());
  }
  ASSERT_GE(observer.summary().cycles, 3U);
  EXPECT_GE(observer.summary().least_cycle.share(), -1e-3);
  EXPECT_LT(observer.summary().least_window.work, 0) << "what was stored came back within the window";
}

}  // namespace
}  // namespace stylet::physics
