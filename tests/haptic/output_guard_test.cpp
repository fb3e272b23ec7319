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

/// Of a device that engages at any force at once, whose rate does not matter and whose motors stay cold.
DeviceLimits wide_open(double max_force) {
  DeviceLimits limits;
  limits.max_force_n = limits.continuous_force_n = max_force;
  limits.max_torque_nm = 0.2;
  limits.max_force_rate_n_per_s = 1e12;
  limits.max_torque_rate_nm_per_s = 1e12;
  limits.engage_force_n = 1e12;
  limits.engage_rise_s = 0;
  return limits;
}

/// A stylus at rest.
GuardedWrench apply(OutputGuard& guard, const Eigen::Vector3d& force, const Eigen::Vector3d& torque, bool valid,
                    double dt_s) {
  return guard.apply({.force = force, .torque = torque, .valid = valid}, dt_s);
}

TEST(OutputGuard, PassesWhatIsWithinTheLimits) {
  OutputGuard guard(wide_open(3.3));
  const Eigen::Vector3d force(1, -2, 0.5), torque(0.01, 0, -0.02);
  const GuardedWrench out = apply(guard, force, torque, true, kDt);
  EXPECT_EQ(out.force, force);
  EXPECT_EQ(out.torque, torque);
  EXPECT_EQ(out.flags, 0u);
}

TEST(OutputGuard, NonFiniteInputGivesZeroAndIsCounted) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    for (int component = 0; component < 3; ++component) {
      OutputGuard guard(wide_open(3.3));
      apply(guard, {1, 1, 1}, kZero, true, kDt);
      Eigen::Vector3d vector(0.1, 0.2, 0.3);
      vector[component] = bad;
      for (const GuardedWrench& out :
           {apply(guard, vector, kZero, true, kDt), apply(guard, kZero, vector, true, kDt)}) {
        EXPECT_EQ(out.force, kZero);
        EXPECT_EQ(out.torque, kZero);
        EXPECT_EQ(out.flags, kOutputNonFinite);
      }
      EXPECT_EQ(guard.counters().count(kOutputNonFinite), 2u);
      EXPECT_EQ(guard.counters().samples, 3u);
    }
  }
}

TEST(OutputGuard, ClampLimitsTheNormAndKeepsTheDirection) {
  // Up to the largest doubles, whose norm overflows.
  for (const double scale : {10.0, 1e9, 1e200, 1.7e308}) {
    OutputGuard guard(wide_open(3.3));
    const Eigen::Vector3d direction(0.8, -0.9, 1.0);
    const GuardedWrench out = apply(guard, scale * direction, kZero, true, kDt);
    EXPECT_NEAR(out.force.norm(), 3.3, 1e-12) << scale;
    EXPECT_NEAR(out.force.normalized().dot(direction.normalized()), 1, 1e-12) << scale;
    EXPECT_EQ(out.flags, kOutputClamped);
    EXPECT_EQ(guard.counters().count(kOutputClamped), 1u);
  }
}

TEST(OutputGuard, TorqueIsZeroForADeviceWithoutTorque) {
  DeviceLimits limits = wide_open(3.3);
  limits.max_torque_nm = 0;
  OutputGuard guard(limits);
  const GuardedWrench out = apply(guard, {1, 0, 0}, {0.5, 0.5, 0.5}, true, kDt);
  EXPECT_EQ(out.torque, kZero);
  EXPECT_EQ(out.force, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(out.flags, 0u);
}

TEST(OutputGuard, StepIsApproachedAtTheLimitedRate) {
  DeviceLimits limits = wide_open(10);
  limits.max_force_rate_n_per_s = 100;  // 0.1 N a sample
  OutputGuard guard(limits);
  const Eigen::Vector3d wanted(3, 4, 0);  // 5 N: 50 samples
  Eigen::Vector3d last = kZero;
  int limited = 0;
  for (int i = 0; i < 60; ++i) {
    const GuardedWrench out = apply(guard, wanted, kZero, true, kDt);
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
  DeviceLimits limits = wide_open(3.3);
  limits.engage_rise_s = 0.5;
  OutputGuard guard(limits);
  for (int i = 1; i <= 600; ++i) {
    const GuardedWrench out = apply(guard, {2, 0, 0}, kZero, true, kDt);
    EXPECT_NEAR(out.force.x(), 2 * std::min(1.0, i * kDt / 0.5), 1e-9) << i;
    // Whether sample 500 still counts as ramp is a matter of rounding.
    if (i != 500) {
      EXPECT_EQ((out.flags & kOutputRising) != 0, i < 500) << i;
    }
  }
}

TEST(OutputGuard, InvalidSampleZeroesTheForceAtOnceAndItRampsUpAgain) {
  DeviceLimits limits = wide_open(3.3);
  limits.engage_rise_s = 0.1;
  OutputGuard guard(limits);
  for (int i = 0; i < 200; ++i) apply(guard, {2, 0, 0}, kZero, true, kDt);
  EXPECT_EQ(apply(guard, {2, 0, 0}, kZero, true, kDt).force.x(), 2);
  const GuardedWrench dropped = apply(guard, {2, 0, 0}, kZero, false, kDt);
  EXPECT_EQ(dropped.force, kZero);
  EXPECT_EQ(dropped.flags, kOutputInvalid);
  EXPECT_EQ(guard.counters().count(kOutputInvalid), 1u);
  EXPECT_NEAR(apply(guard, {2, 0, 0}, kZero, true, kDt).force.x(), 0.02, 1e-9);
}

TEST(OutputGuard, UselessTimeStepHoldsTheForce) {
  DeviceLimits limits = wide_open(3.3);
  OutputGuard guard(limits);
  apply(guard, {1, 0, 0}, kZero, true, kDt);
  for (const double dt : {0.0, -1.0, kNaN, kInf}) {
    EXPECT_EQ(apply(guard, {3, 0, 0}, kZero, true, dt).force, Eigen::Vector3d(1, 0, 0)) << dt;
  }
}

TEST(OutputGuard, LimitsHoldForAnyInput) {
  DeviceLimits limits;
  limits.max_torque_nm = 0.1;
  limits.engage_rise_s = 0.02;
  OutputGuard guard(limits);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-320, 308), sign(-1, 1);
  const auto number = [&] {
    const double roll = sign(random);
    if (roll > 0.99) return kNaN;
    if (roll < -0.99) return kInf;
    return std::copysign(std::pow(10, exponent(random)), sign(random));
  };
  GuardedWrench last;
  Eigen::Vector3d position = kZero;
  int sent = 0;
  for (int i = 0; i < 200'000; ++i) {
    // Mostly a hand that moves and a loop that runs, now and then anything.
    position += 2e-4 * Eigen::Vector3d(sign(random), sign(random), sign(random));
    const auto rarely = [&](double usual) { return sign(random) > 0.99 ? number() : usual; };
    GuardInput input{.force = {number(), number(), number()},
                     .torque = {number(), number(), number()},
                     .position = position,
                     .valid = sign(random) > -0.98,
                     .pose_age_s = rarely(0.004 * (1 + sign(random))),
                     .patch_age_s = rarely(0.2)};
    input.position.x() = rarely(position.x());
    const double dt = rarely(kDt);
    const GuardedWrench out = guard.apply(input, dt);
    ASSERT_TRUE(out.force.allFinite() && out.torque.allFinite()) << i;
    ASSERT_LE(out.force.norm(), limits.max_force_n * (1 + 1e-12)) << i;
    ASSERT_LE(out.torque.norm(), limits.max_torque_nm * (1 + 1e-12)) << i;
    const double step = std::isfinite(dt) ? std::max(dt, 0.0) : 0;
    if (out.force != kZero) {
      ASSERT_LE((out.force - last.force).norm(), limits.max_force_rate_n_per_s * step * (1 + 1e-9) + 1e-12) << i;
      ++sent;
    }
    if (out.torque != kZero) {
      ASSERT_LE((out.torque - last.torque).norm(), limits.max_torque_rate_nm_per_s * step * (1 + 1e-9) + 1e-12) << i;
    }
    last = out;
  }
  EXPECT_EQ(guard.counters().samples, 200'000u);
  EXPECT_GT(sent, 1000) << "the test must see forces";
  for (const OutputFlag seen : {kOutputNonFinite, kOutputClamped, kOutputRateLimited, kOutputRising, kOutputInvalid,
                                kOutputStalePose, kOutputJumped, kOutputTripped, kOutputStalled}) {
    EXPECT_GT(guard.counters().count(seen), 0u) << seen;
  }
}

}  // namespace
}  // namespace stylet::haptic
