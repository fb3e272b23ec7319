// Each limit of the force by itself, on an injected clock.
#include "haptic/output_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

namespace stylet::haptic {
namespace {

using Eigen::Vector3d;

constexpr double kMs = 1e-3;

/// Engages at any force at once and never warms, so that a test sees the limit that it is about.
DeviceLimits free_device() {
  DeviceLimits limits;
  limits.engage_force_n = 1e12;
  limits.engage_rise_s = 0;
  limits.continuous_force_n = limits.max_force_n;
  return limits;
}

/// A mass on the x axis that a constant pull drives against a sampled wall at x < 0.
struct WallRun {
  double first_energy = 0;
  double peak_energy = 0;  ///< after the first second
  double last_energy = 0;
};

/// @param stiffness  of the wall, N/m
/// @param delay      of the force, in samples
WallRun press_wall(const DeviceLimits& limits, double stiffness, int delay) {
  constexpr double kMass = 0.045, kFriction = 0.1, kPull = 0.5;  // kg, N s/m, N
  constexpr int kSubsteps = 50;
  OutputGuard guard(limits);
  double x = 0.010, v = 0;
  std::vector<double> on_the_way(static_cast<std::size_t>(delay), 0.0);
  WallRun run{.first_energy = kPull * x};
  for (int n = 0; n < 4000; ++n) {
    const GuardedWrench out =
        guard.apply({.force = {std::max(0.0, -stiffness * x), 0, 0}, .position = {x, 0, 0}, .valid = true}, kMs);
    on_the_way.push_back(out.force.x());
    const double held = on_the_way.front();
    on_the_way.erase(on_the_way.begin());
    for (int s = 0; s < kSubsteps; ++s) {
      v += (held - kPull - kFriction * v) / kMass * (kMs / kSubsteps);
      x += v * (kMs / kSubsteps);
    }
    // Of the mass, its pull and the wall: what a real wall would never let grow.
    const double wall = x < 0 ? 0.5 * stiffness * x * x : 0;
    run.last_energy = 0.5 * kMass * v * v + kPull * x + wall;
    if (n > 1000) run.peak_energy = std::max(run.peak_energy, run.last_energy);
  }
  return run;
}

TEST(Passivity, WallTooStiffForItsSamplingGainsNoEnergyUnderControl) {
  for (const int delay : {0, 1}) {
    DeviceLimits limits = free_device();
    limits.max_force_n = limits.continuous_force_n = 20;
    limits.max_force_rate_n_per_s = 1e5;
    limits.max_speed_m_per_s = 100;
    limits.max_position_jump_m = 1;
    limits.physical_damping_n_s_per_m = 0.1;
    limits.loop_delay_s = delay * kMs;
    const double stiffness = delay == 0 ? 2500 : 900;
    const WallRun with = press_wall(limits, stiffness, delay);
    limits.max_damping_n_s_per_m = 0;
    const WallRun without = press_wall(limits, stiffness, delay);
    std::printf(
        "wall of %4.0f N/m, force %d ms late: %.2f mJ at first; without control up to %.2f mJ, with %.3f mJ\n",
        stiffness, delay, 1e3 * with.first_energy, 1e3 * without.peak_energy, 1e3 * with.peak_energy);
    EXPECT_GT(without.peak_energy, 1.2 * without.first_energy) << "the wall must be too stiff";
    EXPECT_LT(with.peak_energy, with.first_energy);
  }
}

TEST(Passivity, SpringOnASlowHandIsNotTouched) {
  OutputGuard guard(free_device());
  for (int n = 0; n < 2000; ++n) {  // pressed in and let out again, 6 mm at up to 38 mm/s
    const double depth = 0.003 * (1 - std::cos(4 * M_PI * n * kMs));
    const GuardedWrench out =
        guard.apply({.force = {150 * depth, 0, 0}, .position = {-depth, 0, 0}, .valid = true}, kMs);
    // A sampled spring gives back a little more than it took, here less than the device dissipates by itself.
    ASSERT_NEAR(out.force.x(), 150 * depth, 1e-12) << n;
  }
}

TEST(Passivity, FrictionFeltLongAgoDoesNotPayForActivity) {
  PassivityControl control({}, kMs);
  Vector3d force(1, 0, 0);
  control.sent({2, 0, 0});
  for (int n = 0; n < 1000; ++n) {  // dragged against 2 N for 0.2 m: 0.4 J
    control.step(force, {-2e-4, 0, 0}, kMs);
    control.sent({2, 0, 0});
  }
  EXPECT_LE(control.energy(), 2.0 * 2.0 / (2 * PassivitySettings{}.softest) + 1e-12);
  // Now it pushes the hand on and on: what 2 N may have stored is 20 mJ, and after that it is damped.
  int free_samples = 0;
  for (; free_samples < 1000; ++free_samples) {
    force = {2, 0, 0};
    if (control.step(force, {2e-4, 0, 0}, kMs)) break;
    control.sent({2, 0, 0});
  }
  EXPECT_NEAR(free_samples, 50, 1);
  EXPECT_LT(force.x(), 2);
}

TEST(Passivity, DebtIsForgotten) {
  PassivityControl control({}, kMs);
  Vector3d force = Vector3d::Zero();
  control.sent({1, 0, 0});
  control.step(force, {1e-3, 0, 0}, kMs);  // the environment moves the hand: 1 mJ
  EXPECT_LT(control.energy(), -9e-4);
  control.sent(Vector3d::Zero());
  for (int n = 0; n < 300; ++n) control.step(force, Vector3d::Zero(), kMs);
  EXPECT_GT(control.energy(), -1e-7);
}

TEST(Thermal, FullForceFallsToTheContinuousOneAndNeverHeatsMore) {
  DeviceLimits limits = free_device();
  limits.continuous_force_n = 0.88;
  OutputGuard guard(limits);
  double heat = 0;  // of the force that went out, by the definition of the rating
  double at_peak_s = 0, force = 0;
  for (int n = 0; n < 120'000; ++n) {
    const GuardedWrench out = guard.apply({.force = {0, 0, -5}, .valid = true}, kMs);
    force = out.force.norm();
    if (force > 3.3 - 1e-9) at_peak_s += kMs;
    heat += (force * force - heat) * kMs / limits.thermal_time_constant_s;
    ASSERT_LT(heat, 0.88 * 0.88 * 1.001) << n;
    ASSERT_TRUE(n <= 5000 || (out.flags & kOutputHot) != 0) << n;
  }
  // Half of the continuous heat is reached at t = -tau ln(1 - 0.5 (0.88/3.3)^2).
  const double expected_s = -10 * std::log(1 - 0.5 * std::pow(0.88 / 3.3, 2));
  std::printf("3.3 N for %.3f s (%.3f s), then falling; %.4f N after 120 s\n", at_peak_s, expected_s, force);
  EXPECT_NEAR(at_peak_s, expected_s, 0.006);
  EXPECT_NEAR(force, 0.88, 0.001);
}

TEST(Thermal, RecoversWithRestAndLeavesTheContinuousForceAlone) {
  DeviceLimits limits = free_device();
  limits.continuous_force_n = 0.88;
  OutputGuard guard(limits);
  for (int n = 0; n < 60'000; ++n) {
    ASSERT_EQ(guard.apply({.force = {0.88, 0, 0}, .valid = true}, kMs).flags & ~kOutputRateLimited, 0u) << n;
  }
  for (int n = 0; n < 60'000; ++n) guard.apply({.valid = true}, kMs);
  double force = 0;
  for (int n = 0; n < 10; ++n) force = guard.apply({.force = {3.3, 0, 0}, .valid = true}, kMs).force.x();
  EXPECT_NEAR(force, 3.3, 1e-9);
}

TEST(Engagement, WaitsForASmallForceAndThenRises) {
  DeviceLimits limits = free_device();
  limits.engage_force_n = 0.2;
  limits.engage_rise_s = 0.5;
  OutputGuard guard(limits);
  for (int n = 0; n < 500; ++n) {
    const GuardedWrench out = guard.apply({.force = {1, 0, 0}, .valid = true}, kMs);
    ASSERT_EQ(out.force.x(), 0) << n;
    ASSERT_EQ(out.flags, kOutputWaiting);
  }
  guard.apply({.force = {0.19, 0, 0}, .valid = true}, kMs);
  double last = 0;
  for (int n = 0; n < 600; ++n) {
    const double force = guard.apply({.force = {1, 0, 0}, .valid = true}, kMs).force.x();
    ASSERT_GE(force, last);
    ASSERT_LE(force - last, 2 * kMs / 0.5 + 1e-9) << n;
    last = force;
  }
  EXPECT_EQ(last, 1);
}

TEST(Engagement, RisesSlowlyWhereTheForceStaysLarge) {
  DeviceLimits limits = free_device();
  limits.engage_force_n = 0.2;
  OutputGuard guard(limits);
  double first_s = -1, full_s = -1;
  for (int n = 0; n < 5000; ++n) {
    const double force = guard.apply({.force = {1, 0, 0}, .valid = true}, kMs).force.x();
    if (first_s < 0 && force > 0) first_s = n * kMs;
    if (full_s < 0 && force == 1) full_s = n * kMs;
  }
  EXPECT_NEAR(first_s, 1.0, 0.002);
  EXPECT_NEAR(full_s, 3.0, 0.004);
}

TEST(Staleness, PoseFadesFrom5To20Milliseconds) {
  OutputGuard guard(free_device());
  for (int n = 0; n < 10; ++n) guard.apply({.force = {2, 0, 0}, .valid = true}, kMs);
  for (int age = 1; age <= 40; ++age) {  // the reports stop; the physics goes on pushing
    const GuardedWrench out = guard.apply({.force = {2, 0, 0}, .valid = true, .pose_age_s = age * kMs}, kMs);
    const double share = std::clamp((20 - age) / 15.0, 0.0, 1.0);
    ASSERT_NEAR(out.force.x(), 2 * share, 1e-9) << age;
    ASSERT_EQ((out.flags & kOutputStalePose) != 0, age > 5) << age;
  }
  EXPECT_EQ(guard.counters().count(kOutputStalePose), 35u);
}

TEST(Staleness, PatchFadesFrom200To500Milliseconds) {
  OutputGuard guard(free_device());
  for (int n = 0; n < 10; ++n) guard.apply({.force = {2, 0, 0}, .valid = true}, kMs);
  for (int age = 1; age <= 600; ++age) {
    const GuardedWrench out = guard.apply({.force = {2, 0, 0}, .valid = true, .patch_age_s = age * kMs}, kMs);
    ASSERT_NEAR(out.force.x(), 2 * std::clamp((500 - age) / 300.0, 0.0, 1.0), 1e-9) << age;
    ASSERT_EQ((out.flags & kOutputStalePatch) != 0, age > 200) << age;
  }
}

TEST(Staleness, ForceComesBackInARise) {
  DeviceLimits limits = free_device();
  limits.engage_rise_s = 0.5;
  OutputGuard guard(limits);
  const auto push = [&](double age) {
    return guard.apply({.force = {2, 0, 0}, .valid = true, .pose_age_s = age}, kMs).force.x();
  };
  for (int n = 0; n < 600; ++n) push(0);
  EXPECT_EQ(push(0.0125), 1);         // half faded
  EXPECT_NEAR(push(0), 1.004, 1e-9);  // and no jump back
  EXPECT_EQ(push(0.025), 0);          // gone
  EXPECT_NEAR(push(0), 0.004, 1e-9);
}

TEST(Staleness, AgeThatIsNoAgeGivesZero) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double age : {nan, -0.5, 1e300}) {
    OutputGuard guard(free_device());
    for (int n = 0; n < 10; ++n) guard.apply({.force = {2, 0, 0}, .valid = true}, kMs);
    EXPECT_EQ(guard.apply({.force = {2, 0, 0}, .valid = true, .pose_age_s = age}, kMs).force, Vector3d::Zero());
  }
  OutputGuard guard(free_device());
  guard.apply({.force = {1, 0, 0}, .valid = true}, kMs);
  EXPECT_EQ(guard.apply({.force = {1, 0, 0}, .valid = true, .patch_age_s = nan}, kMs).force, Vector3d::Zero());
}

/// A stylus that moves along x at `speed` for `samples`.
GuardedWrench move(OutputGuard& guard, double& x, double speed, int samples) {
  GuardedWrench out;
  for (int n = 0; n < samples; ++n) {
    x += speed * kMs;
    out = guard.apply({.force = {1, 0, 0}, .position = {x, 0, 0}, .valid = true}, kMs);
  }
  return out;
}

TEST(Trip, ReleasedStylusHasNoForceUntilItIsStill) {
  DeviceLimits limits = free_device();
  limits.max_damping_n_s_per_m = 0;
  OutputGuard guard(limits);
  double x = 0;
  EXPECT_GT(move(guard, x, 0.5, 100).force.x(), 0.9);
  int until = 0;
  while (move(guard, x, 1.5, 1).flags != kOutputTooFast && until < 100) ++until;
  std::printf("from 0.5 to 1.5 m/s: force off after %d ms\n", until + 1);
  EXPECT_LE(until, 5);
  EXPECT_EQ(move(guard, x, 0.8, 1000).force, Vector3d::Zero());  // below the limit, but no hand at rest
  EXPECT_EQ(move(guard, x, 0.1, 90).flags, kOutputTripped);
  EXPECT_GT(move(guard, x, 0.1, 40).force.x(), 0.1);
}

TEST(Trip, JumpOfThePoseCutsTheForceInTheSameSample) {
  OutputGuard guard(free_device());
  double x = 0;
  EXPECT_EQ(move(guard, x, 0, 10).force.x(), 1);
  x += 0.011;
  EXPECT_EQ(move(guard, x, 0, 1).flags, kOutputJumped);
  EXPECT_EQ(move(guard, x, 0, 98).flags, kOutputTripped);
  EXPECT_EQ(move(guard, x, 0, 10).force.x(), 1);
}

TEST(Trip, JumpOfTheOrientationCutsTheForceAndAFastTwirlDoesNot) {
  OutputGuard guard(free_device());
  double angle = 0;
  const auto turn = [&](double by) {
    angle += by;
    return guard.apply({.force = {1, 0, 0},
                        .position = {0, 0, 0},
                        .orientation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d(0, 0.6, 0.8))),
                        .valid = true},
                       kMs);
  };
  for (int n = 0; n < 500; ++n) ASSERT_EQ(turn(0.030).force.x(), 1) << n;  // 30 rad/s, through whole turns
  ASSERT_EQ(turn(0.29).flags & kOutputJumped, 0u);
  EXPECT_EQ(turn(0.31).flags, kOutputJumped);
  EXPECT_EQ(turn(0).force, Vector3d::Zero());
  for (int n = 0; n < 120; ++n) turn(0);
  EXPECT_EQ(turn(0).force.x(), 1);
  EXPECT_EQ(turn(M_PI).flags, kOutputJumped) << "the needle points the other way";
}

TEST(Trip, LateReportIsNoFastMotion) {
  OutputGuard guard(free_device());
  double x = 0;
  for (int n = 0; n < 1000; ++n) {  // 0.8 m/s, but every other report comes a millisecond late
    const bool late = n % 2 == 1;
    if (!late) x = 0.8e-3 * n;
    const GuardedWrench out =
        guard.apply({.force = {-1, 0, 0}, .position = {x, 0, 0}, .valid = true, .pose_age_s = late ? kMs : 0.0}, kMs);
    ASSERT_EQ(out.flags & (kOutputTooFast | kOutputJumped | kOutputTripped), 0u) << n;
  }
}

TEST(Stall, LoopThatStoodStillLongerThanTheDeviceWaitsStartsFromZero) {
  DeviceLimits limits = free_device();
  limits.engage_rise_s = 0.5;
  OutputGuard guard(limits);
  for (int n = 0; n < 600; ++n) guard.apply({.force = {2, 0, 0}, .valid = true}, kMs);
  EXPECT_EQ(guard.apply({.force = {2, 0, 0}, .valid = true}, 0.019).force.x(), 2);
  EXPECT_EQ(guard.apply({.force = {2, 0, 0}, .valid = true}, 0.020).flags, kOutputStalled);
  EXPECT_NEAR(guard.apply({.force = {2, 0, 0}, .valid = true}, kMs).force.x(), 0.004, 1e-9);
}

TEST(OutputFlags, EachHasAName) {
  std::vector<std::string> names;
  for (int bit = 0; bit < kOutputFlagCount; ++bit) names.emplace_back(output_flag_name(bit));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_FALSE(names.front().empty());
}

}  // namespace
}  // namespace stylet::haptic
