#include "haptic/output_guard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace stylet::haptic {
namespace {

constexpr double kDt = 1e-3;
const double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kInf = std::numeric_limits<double>::infinity();
const Eigen::Vector3d kZero = Eigen::Vector3d::Zero();

/// A guard whose ramp is over and whose rate does not matter.
GuardSettings wide_open(double max_force) {
  GuardSettings settings;
  settings.limits.max_force_n = max_force;
  settings.limits.max_torque_nm = 0.2;
  settings.limits.max_force_rate_n_per_s = 1e12;
  settings.max_torque_rate_nm_per_s = 1e12;
  settings.ramp_s = 0;
  return settings;
}

TEST(OutputGuard, PassesWhatIsWithinTheLimits) {
  OutputGuard guard(wide_open(3.3));
  const Eigen::Vector3d force(1, -2, 0.5), torque(0.01, 0, -0.02);
  const GuardedWrench out = guard.apply(force, torque, true, kDt);
  EXPECT_EQ(out.force, force);
  EXPECT_EQ(out.torque, torque);
  EXPECT_EQ(out.flags, 0u);
}

TEST(OutputGuard, NonFiniteInputGivesZeroAndIsCounted) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    for (int component = 0; component < 3; ++component) {
      OutputGuard guard(wide_open(3.3));
      guard.apply({1, 1, 1}, kZero, true, kDt);
      Eigen::Vector3d vector(0.1, 0.2, 0.3);
      vector[component] = bad;
      for (const GuardedWrench& out :
           {guard.apply(vector, kZero, true, kDt), guard.apply(kZero, vector, true, kDt)}) {
        EXPECT_EQ(out.force, kZero);
        EXPECT_EQ(out.torque, kZero);
        EXPECT_EQ(out.flags, kOutputNonFinite);
      }
      EXPECT_EQ(guard.counters().non_finite, 2u);
      EXPECT_EQ(guard.counters().samples, 3u);
    }
  }
}

TEST(OutputGuard, ClampLimitsTheNormAndKeepsTheDirection) {
  // Up to the largest doubles, whose norm overflows.
  for (const double scale : {10.0, 1e9, 1e200, 1.7e308}) {
    OutputGuard guard(wide_open(3.3));
    const Eigen::Vector3d direction(0.8, -0.9, 1.0);
    const GuardedWrench out = guard.apply(scale * direction, kZero, true, kDt);
    EXPECT_NEAR(out.force.norm(), 3.3, 1e-12) << scale;
    EXPECT_NEAR(out.force.normalized().dot(direction.normalized()), 1, 1e-12) << scale;
    EXPECT_EQ(out.flags, kOutputClamped);
    EXPECT_EQ(guard.counters().clamped, 1u);
  }
}

TEST(OutputGuard, TorqueIsZeroForADeviceWithoutTorque) {
  GuardSettings settings = wide_open(3.3);
  settings.limits.max_torque_nm = 0;
  OutputGuard guard(settings);
  const GuardedWrench out = guard.apply({1, 0, 0}, {0.5, 0.5, 0.5}, true, kDt);
  EXPECT_EQ(out.torque, kZero);
  EXPECT_EQ(out.force, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(out.flags, 0u);
}

TEST(OutputGuard, StepIsApproachedAtTheLimitedRate) {
  GuardSettings settings = wide_open(10);
  settings.limits.max_force_rate_n_per_s = 100;  // 0.1 N a sample
  OutputGuard guard(settings);
  const Eigen::Vector3d wanted(3, 4, 0);  // 5 N: 50 samples
  Eigen::Vector3d last = kZero;
  int limited = 0;
  for (int i = 0; i < 60; ++i) {
    const GuardedWrench out = guard.apply(wanted, kZero, true, kDt);
    EXPECT_LE((out.force - last).norm(), 0.1 + 1e-12);
    limited += (out.flags & kOutputRateLimited) != 0 ? 1 : 0;
    last = out.force;
    if (i < 49) {
      EXPECT_NEAR(out.force.norm(), 0.1 * (i + 1), 1e-9);
    }
  }
  EXPECT_LE((last - wanted).norm(), 1e-12);
  EXPECT_NEAR(limited, 49, 1);  // the fiftieth step may or may not be just reached, by rounding
}

TEST(OutputGuard, ForceRisesOverTheRampAfterEngagement) {
  GuardSettings settings = wide_open(3.3);
  settings.ramp_s = 0.5;
  OutputGuard guard(settings);
  for (int i = 1; i <= 600; ++i) {
    const GuardedWrench out = guard.apply({2, 0, 0}, kZero, true, kDt);
    EXPECT_NEAR(out.force.x(), 2 * std::min(1.0, i * kDt / 0.5), 1e-9) << i;
    // Whether sample 500 still counts as ramp is a matter of rounding.
    if (i != 500) {
      EXPECT_EQ((out.flags & kOutputRamped) != 0, i < 500) << i;
    }
  }
}

TEST(OutputGuard, InvalidSampleDropsToZeroAtOnceAndRampsAnew) {
  GuardSettings settings = wide_open(3.3);
  settings.ramp_s = 0.1;
  OutputGuard guard(settings);
  for (int i = 0; i < 200; ++i) guard.apply({2, 0, 0}, kZero, true, kDt);
  EXPECT_EQ(guard.apply({2, 0, 0}, kZero, true, kDt).force.x(), 2);
  const GuardedWrench dropped = guard.apply({2, 0, 0}, kZero, false, kDt);
  EXPECT_EQ(dropped.force, kZero);
  EXPECT_EQ(dropped.flags, kOutputInvalid);
  EXPECT_EQ(guard.counters().invalid, 1u);
  EXPECT_NEAR(guard.apply({2, 0, 0}, kZero, true, kDt).force.x(), 0.02, 1e-9);
}

TEST(OutputGuard, UselessTimeStepHoldsTheForce) {
  GuardSettings settings = wide_open(3.3);
  OutputGuard guard(settings);
  guard.apply({1, 0, 0}, kZero, true, kDt);
  for (const double dt : {0.0, -1.0, kNaN, kInf}) {
    EXPECT_EQ(guard.apply({3, 0, 0}, kZero, true, dt).force, Eigen::Vector3d(1, 0, 0)) << dt;
  }
}

TEST(OutputGuard, LimitsHoldForAnyInput) {
  GuardSettings settings;
  settings.limits = {.max_force_n = 3.3, .max_torque_nm = 0.1, .max_force_rate_n_per_s = 1000};
  settings.ramp_s = 0.02;
  OutputGuard guard(settings);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-320, 308), sign(-1, 1);
  const auto number = [&] {
    const double roll = sign(random);
    if (roll > 0.99) return kNaN;
    if (roll < -0.99) return kInf;
    return std::copysign(std::pow(10, exponent(random)), sign(random));
  };
  Eigen::Vector3d last = kZero;
  for (int i = 0; i < 100'000; ++i) {
    const Eigen::Vector3d force(number(), number(), number()), torque(number(), number(), number());
    const GuardedWrench out = guard.apply(force, torque, sign(random) > -0.98, kDt);
    ASSERT_TRUE(out.force.allFinite() && out.torque.allFinite()) << i;
    ASSERT_LE(out.force.norm(), 3.3 * (1 + 1e-12)) << i;
    ASSERT_LE(out.torque.norm(), 0.1 * (1 + 1e-12)) << i;
    if (out.force != kZero) {
      ASSERT_LE((out.force - last).norm(), 1.0 + 1e-9) << i;
    }
    last = out.force;
  }
  EXPECT_EQ(guard.counters().samples, 100'000u);
}

}  // namespace
}  // namespace stylet::haptic
