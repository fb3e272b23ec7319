// The skin in the hand that holds the probe: its law, its energy, and the simulation's force in the hand.
#include "engine/session/felt_skin.h"
#include "engine/session/live_session.h"
#include "engine/session/needle_base.h"
#include "engine/session/probe_hand.h"
#include "engine/session/recorded_stylus.h"
#include "haptic/output_guard.h"
#include "tests/session/pressed_cube.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <limits>
#include <numbers>

namespace stylet::session {
namespace {

constexpr double kSpring = 500;   // N/m
constexpr double kReach = 0.002;  // m

TEST(SkinCoupling, InTheAirTheProbeIsWhereTheHandIs) {
  const SkinCoupling coupling(kSpring, 0, 0.01);
  for (const Skin& skin : {Skin{}, Skin{.known = true, .gap = 0.002}}) {
    const SkinCoupling::Press far = coupling.press(-0.02, 0, skin, -0.02);
    EXPECT_EQ(far.depth, -0.02);
    EXPECT_EQ(far.force, 0);
  }
  const Skin close{.known = true, .near = true, .gap = 0.001};
  EXPECT_EQ(coupling.press(0.0009, 0, close, 0).force, 0);
  EXPECT_GT(coupling.press(0.0011, 0, close, 0).force, 0);
}

TEST(SkinCoupling, HandAndSkinAreOneSpringInSeries) {
  const SkinCoupling coupling(kSpring, 0, 0.01);
  const Skin skin{.known = true, .near = true, .force = 2, .stiffness = 800};
  for (const double hand : {0.002, 0.006, 0.009}) {
    const SkinCoupling::Press press = coupling.press(hand, 0, skin, 0.004);
    EXPECT_NEAR(press.force, kSpring * (hand - press.depth), 1e-12);
    EXPECT_NEAR(press.force, std::max(0.0, 2 + SkinCoupling::kMargin * 800 * (press.depth - 0.004)), 1e-12);
  }
  // Away from it the hand is not held back.
  const SkinCoupling::Press away = coupling.press(-0.003, 0, skin, 0.004);
  EXPECT_EQ(away.force, 0);
  EXPECT_EQ(away.depth, -0.003);
}

TEST(SkinCoupling, BeyondTheDeepestTheProbeStays) {
  const SkinCoupling coupling(kSpring, 0, 0.01);
  const SkinCoupling::Press press =
      coupling.press(0.05, 0, {.known = true, .near = true, .force = 1, .stiffness = 10}, 0.01);
  EXPECT_EQ(press.depth, 0.01);
  EXPECT_NEAR(press.force, kSpring * 0.04, 1e-12);
}

/// A skin with a law of its own under a probe that follows the hand as HeldProbe's does, found so many steps late.
struct Pressing {
  double law = 1;           ///< exponent
  double at_10_mm = 5;      ///< N
  double frequency = 1;     ///< Hz
  double amplitude = 0.01;  ///< m
  int late = 1;             ///< simulation steps
  double known = 1;         ///< stiffness that is told over the true one
  double moved = 0;         ///< of the skin from where it is at rest, m: by breath

  double force(double depth) const { return depth > moved ? at_10_mm * std::pow((depth - moved) / 0.01, law) : 0; }
  double stiffness(double depth) const { return depth > moved ? law * force(depth) / (depth - moved) : 0; }

  /// Work of the hand over its last cycles, over peak force x stroke.
  double work() const {
    const SkinCoupling coupling(kSpring, 0, 0.03);
    const double period = 1 / frequency;
    std::deque<std::pair<double, Skin>> found;
    double probe = -amplitude, force = 0, hand = -amplitude, done = 0, most = 0;
    const int cycles = 6;
    const int steps = static_cast<int>(std::lround(cycles * period * 1000));
    for (int k = 0; k < steps; ++k) {
      const double t = 1e-3 * k;
      const double next = 0.2 * amplitude - amplitude * std::cos(2 * std::numbers::pi * frequency * t);
      if (k % 20 == 0) {  // the simulation's step
        found.emplace_back(probe, Skin{.known = true,
                                       .near = probe > moved - kReach,
                                       .gap = std::clamp(moved - probe, 0.0, kReach),
                                       .force = this->force(probe),
                                       .stiffness = known * stiffness(probe)});
        while (found.size() > static_cast<std::size_t>(late) + 1) found.pop_front();
      }
      const SkinCoupling::Press press = coupling.press(next, 0, found.front().second, found.front().first);
      // Of the law, not of its being held for a millisecond.
      if (t >= period) done += 0.5 * (force + press.force) * (next - hand);
      hand = next;
      force = press.force;
      probe += (press.depth - probe) * 1e-3 / HeldProbe::kTrackedConstant;
      most = std::max(most, force);
    }
    return most > 0 ? done / (most * 2 * amplitude * (cycles - 1)) : 0;
  }
};

TEST(SkinCoupling, GivesAHandNoEnergyOverAClosedCycle) {
  double least = std::numeric_limits<double>::infinity();
  for (const double law : {1.0, 1.5, 2.0}) {
    for (const double at_10_mm : {1.0, 5.0, 20.0}) {
      for (const double frequency : {0.2, 1.0, 4.0}) {
        for (const double amplitude : {0.002, 0.01, 0.02}) {
          for (const int late : {0, 1, 3}) {
            for (const double known : {0.8, 1.0, 1.2}) {
              for (const double moved : {-0.004, 0.0, 0.004}) {
                const double work = Pressing{law, at_10_mm, frequency, amplitude, late, known, moved}.work();
                if (work < least) {
                  std::printf("[ law %.1f, %4.1f N, %.1f Hz, %2.0f mm, %d late, k %.1f, moved %+2.0f mm ] %+.3f %%\n",
                              law, at_10_mm, frequency, 1e3 * amplitude, late, known, 1e3 * moved, 100 * work);
                }
                least = std::min(least, work);
              }
            }
          }
        }
      }
    }
  }
  EXPECT_GT(least, -1e-4);
}

/// A device that nobody holds tight, pushed against a skin that does not give way: force sampled at 1 kHz and late,
/// through the guard.
double swing_after(const haptic::DeviceLimits& limits, double stiffness, double damping) {
  const SkinCoupling coupling(stiffness, damping, 1);
  haptic::OutputGuard guard(limits);
  const Skin skin{.known = true, .near = true, .gap = 0};
  constexpr double kMass = 0.15, kPush = 1, kFine = 1e-5;  // kg, N, s
  std::deque<double> under_way(static_cast<std::size_t>(std::lround(limits.loop_delay_s * 1000)), 0.0);
  double depth = -0.001, speed = 0, last = depth, felt_speed = 0, force = 0, least = 1, most = -1;
  for (int ms = 0; ms < 10'000; ++ms) {
    felt_speed += (1 - std::exp(-1e-3 / 0.002)) * ((depth - last) / 1e-3 - felt_speed);
    last = depth;
    const double wanted = coupling.press(depth, felt_speed, skin, 0).force;
    const haptic::GuardedWrench out =
        guard.apply({.force = {0, 0, wanted}, .position = {0, 0, -depth}, .valid = true}, 1e-3);
    under_way.push_back(out.force.z());
    force = under_way.front();
    under_way.pop_front();
    for (double t = 0; t < 1e-3 - kFine / 2; t += kFine) {
      speed += kFine * (kPush - force - limits.physical_damping_n_s_per_m * speed) / kMass;
      depth += kFine * speed;
    }
    if (ms < 8000) continue;
    least = std::min(least, depth);
    most = std::max(most, depth);
  }
  return most - least;
}

TEST(SkinCoupling, ALightDeviceOnARigidSkinComesToRest) {
  for (const double delay_s : {0.0015, 0.003}) {
    const haptic::DeviceLimits limits{.renders_force = true, .max_force_n = 10, .loop_delay_s = delay_s};
    const physics::NeedleBase held = needle_base(limits, 1000);
    const double swing = swing_after(limits, held.stiffness, held.damping);
    const double undamped = swing_after(limits, limits.max_stiffness_n_per_m, 0);
    std::printf("[ %.1f ms late, %.0f N/m, %.0f N s/m ] swings by %.3f mm; as stiff as its data sheet says %.3f mm\n",
                1e3 * delay_s, held.stiffness, held.damping, 1e3 * swing, 1e3 * undamped);
    EXPECT_LT(swing, 0.05e-3);
  }
}

TEST(FeltSkin, TheHandFeelsTheForceOfTheSimulation) {
  const content::Scene scene = tests::pressed_cube();
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  HeldProbe probe(scene);
  FeltSkin skin;
  ProbeHand hand(scene, probe, skin, kSpring, 2);
  const support::TemporaryFolder folder;
  LiveSession session(scene, device,
                      {.duration_s = 10,
                       .lockstep = true,
                       .recording = folder / "felt",
                       .build = "test",
                       .probe = &probe,
                       .listeners = {&skin}});
  session.start();
  const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
  const auto hold = [&](double z, double seconds) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (double t = 0; t < seconds; t += 0.01) {
      session.advance(0.01);
      hand.follow({0, 0, z}, level, session.time_s());
      force = hand.force({0, 0, z}, level, 0.01);
    }
    return force;
  };
  hold(0, 0.1);  // taken up on the skin
  EXPECT_EQ(hold(0.02, 1.5).norm(), 0) << "in the air";
  const Eigen::Vector3d pressed = hold(-0.008, 2);
  const Skin& found = skin.newest();
  std::printf("[ 8 mm ] %.3f N in the hand, %.3f N in the simulation, %.0f N/m\n", pressed.z(), found.force,
              found.stiffness);
  EXPECT_GT(pressed.z(), 0.2) << "up: the skin pushes back";
  EXPECT_NEAR(pressed.z(), found.force, 0.01 * found.force);
  EXPECT_LT(pressed.head<2>().norm(), 1e-9);
  EXPECT_LT(probe.moved().press, 0.008) << "the skin holds the probe back";
  EXPECT_EQ(hold(0.02, 1.5).norm(), 0);
  hand.release();
  EXPECT_EQ(hand.force({0, 0, -0.01}, level, 0.01).norm(), 0);
  session.stop();
}

}  // namespace
}  // namespace stylet::session
