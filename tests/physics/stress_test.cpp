// The haptic loop under hands that nobody has: wide swings, random strokes of 1 m/s and 14 rad/s, fine needles, high
// rates, late patches; in one body, and in two that press on each other under the probe.
#include "tests/physics/needle_track_runs.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

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

/// What a run came to. A puncture, and the tip's going out of tissue, may change the force at once.
struct Worst {
  bool two_bodies = false;  // where they touch, the tip goes from one into the other: then in the next step, too
  double change = 0;        // of the force in a millisecond without a surface gone through, N
  double force = 0;         // N
  double beside = 0;        // of a contact from the needle, m
  std::uint32_t flags = 0;
  long steps = 0;
  int inverted = 0;  // tetrahedra
  bool finite = true;

  void add(const physics::NeedleState& state, int steps_a_ms) {
    flags |= state.flags;
    finite = finite && state.positions.leftCols(state.node_count).allFinite() && state.wrench.force.allFinite() &&
             state.wrench.moment.allFinite();
    force = std::max(force, state.wrench.force.norm());
    if (++steps % steps_a_ms != 0) return;
    for (int i = 0; i < state.contact_count; ++i)
      beside = std::max(beside, distance(state, state.contacts[i].position));
    const bool through =
        state.puncture_count != punctures || state.tip != tip || (two_bodies && state.tip_body != tip_body);
    if (!through && !(two_bodies && was_through)) change = std::max(change, (state.wrench.force - before).norm());
    was_through = through;
    before = state.wrench.force;
    punctures = state.puncture_count;
    tip = state.tip;
    tip_body = state.tip_body;
  }

private:
  static double distance(const physics::NeedleState& state, const Vector3d& x) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k + 1 < state.node_count; ++k) {
      const Vector3d from = state.positions.col(k), way = state.positions.col(k + 1) - from;
      const double part = std::clamp((x - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (x - from - part * way).norm());
    }
    return least;
  }

  Vector3d before = Vector3d::Zero();
  std::uint32_t punctures = 0;
  physics::TipState tip = physics::TipState::outside;
  int tip_body = -1;
  bool was_through = false;
};

/// Where a hand is that goes in and then loses all measure.
class WildHand {
public:
  static constexpr double kIn = 0.3;  // s
  /// @param rise  of its speed, s
  WildHand(const physics::StylusPose& start, double depth, bool swings, double rise, std::mt19937& random)
      : start_(start), depth_(depth), rise_(rise), swings_(swings), way_(random, 1.0), turn_(random, 14.0) {}

  physics::StylusPose at(double time) const {
    physics::StylusPose hub = start_;
    hub.position += (rise_ > 0 ? smooth(time / kIn) : std::min(time / kIn, 1.0)) * depth_ *
                    (start_.orientation * Vector3d::UnitZ());
    const double t = std::max(0.0, time - kIn);
    const double share = rise_ > 0 ? smooth(t / rise_) : 1;
    if (swings_) {
      hub.position +=
          share * 0.080 * std::sin(2 * std::numbers::pi * 2 * t) * (start_.orientation * Vector3d::UnitX());
    } else {
      hub.position += share * way_.at(t);
      const Vector3d rotation = share * turn_.at(t);
      const double angle = rotation.norm();
      if (angle > 0) hub.orientation = Eigen::AngleAxisd(angle, rotation / angle) * hub.orientation;
    }
    return hub;
  }

private:
  static double smooth(double u) {
    u = std::clamp(u, 0.0, 1.0);
    return u * u * (3 - 2 * u);
  }

  physics::StylusPose start_;
  double depth_, rise_;
  bool swings_;
  RandomMotion way_, turn_;
};

Worst stress(unsigned seed) {
  constexpr double kStress = kSanitized ? 0.1 : 0.4;  // s
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
  insertion.duration = WildHand::kIn + kStress;
  reference::ReferenceRun settings{
      .coupling = Coupling::stylet, .track = {.bevel_ratio = one_of(0.0, 0.2)}, .tissues = tissue(liver())};
  settings.latency_steps = static_cast<int>(random() % 2);
  reference::ReferenceExperiment experiment(insertion, settings);
  const WildHand hand(insertion.base(0), kDepth + 0.0005, seed % 3 == 0, 0, random);
  const double dt = 1 / insertion.haptic_hz;
  const int steps_a_ms = static_cast<int>(std::lround(insertion.haptic_hz / 1000));
  Worst worst;
  double time = 0;
  while (time < insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      time += dt;
      worst.add(experiment.haptic().step(hand.at(time), dt, experiment.patch_in_use()), steps_a_ms);
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

/// Young's modulus (Pa) and resistance of some of content/tissues.json.
struct Tissue {
  double young_modulus = 0;
  physics::InsertionResistance resistance;
};
const std::array<Tissue, 5> kTissues{
    Tissue{5e3, {0.2, 0.4, 1, 10, 0.15, 50, 100}},      // fat
    Tissue{15e3, {1.8, 0.94, 2, 18, 0.15, 100, 164}},   // liver
    Tissue{30e3, {0.8, 0.9, 2, 25, 0.15, 100, 550}},    // muscle
    Tissue{70e3, {2.2, 1.2, 2, 30, 0.15, 100, 300}},    // tumour
    Tissue{200e3, {3.0, 1.5, 2, 30, 0.15, 100, 1100}},  // skin
};

/// Two plates of 100 mm on each other, the upper one (30 mm) held at its rim, the lower one (40 mm) at its floor, and
/// the probe pressed 10 mm deep beside the needle.
Worst stress_two_bodies(unsigned seed) {
  constexpr double kStress = kSanitized ? 0.05 : 0.5;  // s
  constexpr double kHalf = 0.05, kUpper = 0.03, kLower = 0.04;
  std::mt19937 random(seed);
  const auto one_of = [&](auto... values) {
    const std::array all{values...};
    return all[random() % all.size()];
  };
  const std::array<Tissue, 2> tissues{kTissues[random() % kTissues.size()], kTissues[random() % kTissues.size()]};
  auto map = std::make_shared<physics::TissueMap>();
  map->origin = {-0.06, -0.06, -0.08};
  map->spacing = 2e-3;
  map->size = {61, 61, 46};
  for (int k = 0; k < map->size.z(); ++k) {
    const double z = map->origin.z() + map->spacing * k;
    const std::uint8_t label = z > 0 ? 0 : z > -kUpper ? 1 : 2;
    map->labels.insert(map->labels.end(), static_cast<std::size_t>(61 * 61), label);
  }
  map->tissues = {{}, tissues[0].resistance, tissues[1].resistance};
  std::vector<physics::SimulationBody> bodies(2);
  for (std::size_t b = 0; b < 2; ++b) {
    const double top = b == 0 ? 0 : -kUpper, foot = b == 0 ? -kUpper : -kUpper - kLower;
    bodies[b].mesh = reference::kuhn_box({-kHalf, -kHalf, foot}, {kHalf, kHalf, top}, {8, 8, 3});
    bodies[b].tet_materials.assign(bodies[b].mesh.tets.size(), {tissues[b].young_modulus, 0.45});
    bodies[b].fixed_nodes = reference::nodes_where(bodies[b].mesh, [&](const Vector3d& x) {
      return b == 0 ? x.head<2>().cwiseAbs().maxCoeff() > kHalf - 1e-9 : x.z() < foot + 1e-9;
    });
  }
  const double simulation_hz = one_of(25.0, 50.0, 100.0);
  const double haptic_hz = kSanitized ? 1000 : one_of(1000.0, 4000.0, 10000.0);
  physics::SimulationLoopSettings simulation_settings{.dt = 1 / simulation_hz, .lay_contacts = false};
  simulation_settings.contact.pairs = {{.nodes_of = 1, .surface_of = 0}};
  simulation_settings.contact.probe.emplace();
  simulation_settings.contact.probe->friction = one_of(0.05, 0.5);
  physics::SimulationLoop simulation(std::move(bodies), simulation_settings);
  physics::HapticLoopSettings settings;
  settings.needle.length = 0.15;
  settings.needle.beams = one_of(8, 16, 32, 64);
  settings.needle.yield_strength = one_of(0.0, 1e9);
  settings.coupling = Coupling::stylet;
  settings.track.spacing = one_of(0.005, 0.010);
  settings.track.bevel_ratio = one_of(0.0, 0.2);
  settings.tissues = map;
  physics::StylusPose start;
  const double slant = 0.5 * static_cast<double>(random() % 100) / 100;
  start.orientation = Eigen::Quaterniond(
      Eigen::AngleAxisd(std::numbers::pi - slant, Vector3d(std::cos(seed), std::sin(seed), 0).normalized()));
  start.position = Vector3d(0, -0.01, 0.005) - settings.needle.length * (start.orientation * Vector3d::UnitZ());
  physics::HapticLoop haptic(settings, start);
  const WildHand hand(start, 0.055, seed % 3 == 0, 0.05, random);
  physics::RigidPose probe;
  probe.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()));

  physics::TissuePatch patch = simulation.make_patch();
  Worst worst;
  worst.two_bodies = true;
  const int ratio = static_cast<int>(std::lround(haptic_hz / simulation_hz));
  const int steps_a_ms = static_cast<int>(std::lround(haptic_hz / 1000));
  for (int step = 0; step < haptic_hz * (WildHand::kIn + kStress); ++step) {
    const double time = step / haptic_hz;
    if (step % ratio == 0) {
      probe.position = {0.01 * std::sin(10 * time), 0.03, -0.010 * std::min(1.0, time / 0.2)};
      const auto report = simulation.step({.needle = &haptic.state(), .time_s = time, .probe = &probe}, patch);
      worst.inverted += report.inverted_tets;
      EXPECT_EQ(report.flags & (physics::kSimulationNonFinite | physics::kSimulationFactorisationFailed), 0U);
      simulation.worker().step();
    }
    worst.add(haptic.step(hand.at(time + 1 / haptic_hz), 1 / haptic_hz, patch), steps_a_ms);
  }
  return worst;
}

TEST(Stress, NoHandBreaksTheHapticStepInOrgansThatPressOnEachOther) {
  constexpr unsigned kRuns = kSanitized ? 3 : 20;
  double worst_change = 0, worst_force = 0, worst_beside = 0;
  long steps = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const Worst worst = stress_two_bodies(seed);
    EXPECT_TRUE(worst.finite) << "run " << seed;
    EXPECT_EQ(worst.flags & (physics::kNeedleSolveFailed | physics::kNeedleNonFinite), 0U) << "run " << seed;
    EXPECT_EQ(worst.inverted, 0) << "run " << seed;
    // Not 1 N as above: a needle that tissue holds bent far, and lets go, is elsewhere in the next step.
    EXPECT_LE(worst.change, 2.0) << "N in a millisecond, run " << seed;
    EXPECT_LE(worst.force, 20) << "N, run " << seed;  // what skin beside and before it holds; 40 N and more before
    EXPECT_LE(worst.beside, 0.025) << "m beside the needle, run " << seed;  // what gives way is cut by then
    worst_change = std::max(worst_change, worst.change);
    worst_force = std::max(worst_force, worst.force);
    worst_beside = std::max(worst_beside, worst.beside);
    steps += worst.steps;
  }
  std::printf("%u runs, %ld steps: force up to %.1f N, changes by up to %.3f N in a millisecond, %.1f mm beside\n",
              kRuns, steps, worst_force, worst_change, 1e3 * worst_beside);
}

}  // namespace
}  // namespace stylet::bench
