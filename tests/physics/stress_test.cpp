// The haptic loop under hands that nobody has: wide swings, random strokes of 1 m/s and 14 rad/s, fine needles, high
// rates, late patches.
#include "tests/physics/needle_track_runs.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <random>

namespace stylet::bench {
namespace {

using Eigen::Vector3d;
using physics::Coupling;
using support::kSanitized;

/// Smooth random motion: sines of 1 to 5 Hz with random phases, scaled so that the rate never exceeds `most`.
struct RandomMotion {
  RandomMotion(std::mt19937& random, double most) {
    std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi), hz(1, 5);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 3; ++k) {
        omega[axis][k] = 2 * std::numbers::pi * hz(random);
        shift[axis][k] = phase(random);
        size[axis][k] = most / (3 * std::sqrt(3.0) * omega[axis][k]);
      }
    }
  }
  Vector3d at(double t) const {
    Vector3d sum = Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 3; ++k) {
        sum[axis] += size[axis][k] * (std::sin(omega[axis][k] * t + shift[axis][k]) - std::sin(shift[axis][k]));
      }
    }
    return sum;
  }
  std::array<std::array<double, 3>, 3> omega{}, shift{}, size{};
};

struct Worst {
  double change = 0;  // of the force in a millisecond without a surface gone through, N
  double force = 0;   // N
  std::uint32_t flags = 0;
  long steps = 0;
  bool finite = true;
};

Worst stress(unsigned seed) {
  constexpr double kIn = 0.3, kStress = kSanitized ? 0.1 : 0.4;  // s
  constexpr double kDepth = 0.06;
  std::mt19937 random(seed);
  const auto one_of = [&](auto... values) {
    const std::array all{values...};
    return all[random() % all.size()];
  };
  reference::ReferenceInsertion insertion = there_and_back(kDepth, 0);
  insertion.needle.beams = one_of(8, 16, 32, 64);
  insertion.haptic_hz = kSanitized ? 1000 : one_of(1000.0, 4000.0, 10000.0);
  insertion.simulation_hz = one_of(25.0, 50.0);
  insertion.contact_spacing = one_of(0.005, 0.010);
  insertion.duration = kIn + kStress;
  reference::ReferenceRun settings{
      .coupling = Coupling::stylet, .track = {.bevel_ratio = one_of(0.0, 0.2)}, .tissues = tissue(liver())};
  settings.latency_steps = static_cast<int>(random() % 2);
  reference::ReferenceExperiment experiment(insertion, settings);
  const RandomMotion way(random, 1.0), turn(random, 14.0);
  const bool swings = seed % 3 == 0;

  const physics::StylusPose start = insertion.base(0);
  const Vector3d along = start.orientation * Vector3d::UnitZ(), across = start.orientation * Vector3d::UnitX();
  const double dt = 1 / insertion.haptic_hz;
  const int steps_a_ms = static_cast<int>(std::lround(insertion.haptic_hz / 1000));
  Worst worst;
  double time = 0;
  Vector3d before = Vector3d::Zero();
  std::uint32_t punctures = 0;
  physics::TipState tip = physics::TipState::outside;
  while (time < insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      time += dt;
      physics::StylusPose hub = start;
      hub.position += std::min(time / kIn, 1.0) * (kDepth + 0.0005) * along;
      const double t = std::max(0.0, time - kIn);
      if (swings) {
        hub.position += 0.080 * std::sin(2 * std::numbers::pi * 2 * t) * across;
      } else {
        hub.position += way.at(t);
        const Vector3d rotation = turn.at(t);
        const double angle = rotation.norm();
        if (angle > 0) hub.orientation = Eigen::AngleAxisd(angle, rotation / angle) * hub.orientation;
      }
      const physics::NeedleState& state = experiment.haptic().step(hub, dt, experiment.patch_in_use());
      worst.flags |= state.flags;
      worst.finite = worst.finite && state.positions.leftCols(state.node_count).allFinite() &&
                     state.wrench.force.allFinite() && state.wrench.moment.allFinite();
      worst.force = std::max(worst.force, state.wrench.force.norm());
      if (++worst.steps % steps_a_ms != 0) continue;
      const bool through = state.puncture_count != punctures || state.tip != tip;  // into tissue or out of it
      if (!through) {
        worst.change = std::max(worst.change, (state.wrench.force - before).norm());
      }
      before = state.wrench.force;
      punctures = state.puncture_count;
      tip = state.tip;
    }
  }
  return worst;
}

TEST(Stress, NoHandBreaksTheHapticStep) {
  constexpr unsigned kRuns = kSanitized ? 9 : 60;
  double worst_change = 0, worst_force = 0;
  long steps = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const Worst worst = stress(seed);
    EXPECT_TRUE(worst.finite) << "run " << seed;
    EXPECT_EQ(worst.flags & (physics::kNeedleSolveFailed | physics::kNeedleNonFinite), 0U) << "run " << seed;
    EXPECT_LE(worst.change, 1.0) << "N in a millisecond, run " << seed;
    worst_change = std::max(worst_change, worst.change);
    worst_force = std::max(worst_force, worst.force);
    steps += worst.steps;
  }
  std::printf("%u runs, %ld steps: force up to %.1f N, changes by up to %.3f N in a millisecond\n", kRuns, steps,
              worst_force, worst_change);
}

}  // namespace
}  // namespace stylet::bench
