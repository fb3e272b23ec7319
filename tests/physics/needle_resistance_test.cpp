// What a needle is known by where tissue resists it: rise, drop at puncture, friction that grows with depth,
// hysteresis, a lower second insertion; and steering.
#include "tests/physics/needle_track_runs.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Coupling;
using physics::TipState;
using support::kSanitized;

TEST(NeedleTrack, ForceOverDepthHasThePublishedShape) {
  const auto samples = run(there_and_back(0.075, 0.030), {.coupling = Coupling::stylet, .tissues = tissue(liver())});
  const auto puncture =
      std::find_if(samples.begin(), samples.end(), [](const Sample& s) { return s.state == TipState::inside; });
  ASSERT_NE(puncture, samples.end());
  EXPECT_NEAR(puncture->force, 1.8, 0.02);  // rises to the capsule's strength and no further
  for (auto s = samples.begin(); s + 1 < puncture; ++s) EXPECT_GE((s + 1)->force, s->force - 1e-3);

  double lowest = 10;
  auto at = puncture;
  for (; at->time < puncture->time + 0.25; ++at) lowest = std::min(lowest, at->force);
  std::printf("puncture at %.2f N, then %.2f N\n", puncture->force, lowest);
  EXPECT_LT(lowest, 0.9 * puncture->force);

  // Steady cutting: friction grows by 18 N/m of depth.
  const auto sample_at = [&](double tip, auto from) {
    return std::find_if(from, samples.end(), [&](const Sample& s) { return s.tip >= tip; });
  };
  const auto shallow = sample_at(0.045, at);
  const auto deep = sample_at(0.065, at);
  const double slope = (deep->force - shallow->force) / (deep->depth - shallow->depth);
  std::printf("friction grows by %.1f N/m\n", slope);
  EXPECT_NEAR(slope, 18, 2);

  // On the way back the force changes its sign, and nothing is cut: smaller than on the way in.
  const auto turned = turning_point(samples);
  const auto back = std::find_if(turned, samples.end(), [](const Sample& s) { return s.tip <= 0.045; });
  ASSERT_NE(back, samples.end());
  std::printf("at 45 mm: %.2f N in, %.2f N out", shallow->force, back->force);
  EXPECT_LT(back->force, -0.3);
  EXPECT_LT(-back->force, shallow->force);

  // The second way in follows the same channel: friction only.
  const auto again =
      sample_at(0.055, std::find_if(back, samples.end(), [](const Sample& s) { return s.tip < 0.04; }));
  ASSERT_NE(again, samples.end());
  const auto first = sample_at(0.055, at);
  std::printf("; at 55 mm: %.2f N the first time, %.2f N the second\n", first->force, again->force);
  EXPECT_LT(again->force, first->force - 0.5 * 0.94);
  EXPECT_EQ(samples.back().punctures, 1U);
}

/// The needle pressed straight on an elastic cube until its surface breaks at 0.1 N, half a millimetre in.
struct FirstPuncture {
  physics::Puncture puncture;
  double work = 0;  // of the hand until then, J
  double way = 0;   // of the hub since the tip touched, m
};
FirstPuncture first_puncture(double cutting_force) {
  const reference::ReferenceInsertion insertion = there_and_back(0.020, 0.019);
  reference::ReferenceExperiment experiment(
      insertion,
      {.coupling = Coupling::stylet, .tissues = tissue({.puncture_force = 0.1, .cutting_force = cutting_force})});
  double touched = 0;
  while (experiment.needle().puncture_count == 0 && experiment.time_s() < insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      if (experiment.needle().tip == TipState::outside) touched = experiment.needle().positions(0, 0);
      if (experiment.needle().puncture_count > 0) break;
    }
  }
  return {experiment.needle().last_puncture, experiment.needle().hand_work,
          experiment.needle().positions(0, 0) - touched};
}

// By hand: until the surface breaks everything is elastic and slow, so all that the hand did is stored, a triangle of
// the force over the way; without a cutting force all of it is released, with half of 0.1 N a quarter is kept.
TEST(NeedleTrack, APunctureReleasesWhatTheHandHadStored) {
  const FirstPuncture all = first_puncture(0), part = first_puncture(0.05);
  std::printf("released %.3f uJ of %.3f uJ put in, %.3f uJ under the triangle; with a cutting force %.3f uJ\n",
              1e6 * all.puncture.energy, 1e6 * all.work, 1e6 * 0.5 * 0.1 * all.way, 1e6 * part.puncture.energy);
  EXPECT_NEAR(all.puncture.force, 0.1, 1e-9);
  EXPECT_NEAR(all.puncture.energy, all.work, 0.05 * all.work);
  EXPECT_NEAR(all.puncture.energy, 0.5 * 0.1 * all.way, 0.1 * all.work);
  EXPECT_NEAR(part.puncture.energy, 0.75 * all.puncture.energy, 1e-3 * all.puncture.energy);
}

// Coulomb friction whose bound follows the force that presses the shaft: without an update of the bounds they are
// those of the step before.
TEST(NeedleTrack, FrictionBoundsThatLagAreFlagged) {
  const auto flags = [](const physics::BoundedSolveLimits& limits) {
    reference::ReferenceInsertion insertion = r1();
    reference::ReferenceExperiment laying(insertion, {.coupling = Coupling::stylet});  // only for its patches' shape
    physics::SimulationLoop& simulation = laying.simulation();
    physics::HapticLoopSettings settings;
    settings.needle = insertion.needle;
    settings.coupling = Coupling::stylet;
    settings.tissues = tissue({.friction_per_length = 5, .friction_coefficient = 0.3});
    settings.solve_limits = limits;
    physics::HapticLoop haptic(settings, insertion.base(0));
    physics::TissuePatch patch = simulation.make_patch();
    std::uint32_t seen = 0;
    int steps = 0;
    for (double time = 0; time < 1.0;) {
      simulation.step({.needle = &haptic.state(), .time_s = time}, patch);
      for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
        time = ++steps / insertion.haptic_hz;
        seen |= haptic.step(insertion.base(time), 1 / insertion.haptic_hz, patch).flags;
      }
    }
    return seen;
  };
  EXPECT_EQ(flags({}), 0U);
  EXPECT_EQ(flags({.bound_updates = 0}), std::uint32_t{physics::kNeedleBoundsLagged});
}

// Out of the body by 6 mm, the hand moved sideways while the tip is free, and in again.
TEST(NeedleTrack, ATipNearItsOldHoleGoesInThereAndBesideItMakesANewOne) {
  const auto punctures = [](double sideways) {
    reference::ReferenceInsertion insertion = there_and_back(0.030, -0.006);
    const double outside = (0.030 + 0.036) / 0.045;  // the middle of the time that the tip is out
    insertion.lateral_amplitude = sideways;
    insertion.lateral_start = outside - 0.1;
    insertion.lateral_end = outside + 0.1;
    const auto samples = run(
        insertion, {.coupling = Coupling::stylet, .tissues = tissue({.puncture_force = 0.3, .cutting_force = 0.1})});
    EXPECT_EQ(samples.back().state, TipState::inside);
    return samples.back().punctures;
  };
  EXPECT_EQ(punctures(0), 1U);
  EXPECT_EQ(punctures(1e-3), 1U);
  EXPECT_EQ(punctures(6e-3), 2U);
}

// Nothing but a force that grows with length and speed: what the hand feels is their product.
TEST(NeedleTrack, ViscousFrictionGrowsWithDepthAndSpeed) {
  constexpr double kViscous = 200;  // N s/m^2
  for (const double speed : {0.0225, 0.045}) {
    reference::ReferenceInsertion insertion = there_and_back(0.050, 0.040);
    insertion.axial_speed = {{0, speed}, {1 + 0.050 / speed, speed}};
    insertion.duration = 0.050 / speed;
    const auto samples =
        run(insertion, {.coupling = Coupling::stylet, .tissues = tissue({.viscous_friction = kViscous})});
    const Sample& end = samples.back();
    std::printf("%.1f mm/s, %.1f mm inside: %.4f N of %.4f N\n", 1e3 * speed, 1e3 * end.depth, end.force,
                kViscous * end.depth * speed);
    EXPECT_NEAR(end.force, kViscous * end.depth * speed, 0.05 * end.force);
  }
}

// The shaft pressed sideways by a hand that bends it, on its way in: every contact slides at its own bound.
TEST(NeedleTrack, FrictionFollowsTheForceThatPressesTheShaft) {
  constexpr double kCoefficient = 0.3;
  reference::ReferenceInsertion insertion = r1();
  insertion.duration = 1.0;
  reference::ReferenceExperiment experiment(
      insertion, {.coupling = Coupling::stylet, .tissues = tissue({.friction_coefficient = kCoefficient})});
  while (experiment.time_s() < insertion.duration - 1e-9) experiment.advance();
  const physics::NeedleState& needle = experiment.needle();
  double pressed = 0, furthest = 0;
  for (int c = 0; c < needle.contact_count; ++c) {
    const physics::NeedleContact& contact = needle.contacts[c];
    const Eigen::Vector3d along =
        (needle.positions.col(contact.beam + 1) - needle.positions.col(contact.beam)).normalized();
    const double axial = contact.force.dot(along), across = (contact.force - axial * along).norm();
    std::printf("contact %d: %.2f mN across, %.2f mN along\n", c, 1e3 * across, 1e3 * axial);
    pressed += across;
    furthest = std::max(furthest, std::abs(axial - kCoefficient * across));
  }
  EXPECT_GT(pressed, 0.2);
  EXPECT_LT(furthest, 0.05 * kCoefficient * pressed);
}

TEST(NeedleTrack, NoMotionThereAndBackGivesEnergy) {
  const auto samples = run(there_and_back(kSanitized ? 0.030 : 0.060, 0.0),
                           {.coupling = Coupling::stylet, .tissues = tissue(liver())});
  double least = 0;
  for (const Sample& s : samples) least = std::min(least, s.work);
  std::printf("work of the hand: never below %.2e J, %.4f J in the end\n", least, samples.back().work);
  EXPECT_GT(least, -1e-6);
  EXPECT_GT(samples.back().work, 0.01);
}

// The bristles slide at the same friction, and only give way a little before; so does the tissue anyway.
TEST(NeedleTrack, BristlesWithoutStictionMakeTheForceOfCoulombFriction) {
  const reference::ReferenceInsertion insertion = there_and_back(0.060, 0.030);
  reference::ReferenceRun settings{.coupling = Coupling::stylet, .tissues = tissue(liver())};
  const auto coulomb = run(insertion, settings);
  settings.track.friction = physics::ShaftFriction::lugre;
  settings.track.lugre.stiction = 1;
  // In the step in which the tip comes back to where it has cut, bounds may not settle: an error of first order.
  const auto lugre = run(insertion, settings, physics::kNeedleBoundsLagged);
  ASSERT_EQ(coulomb.size(), lugre.size());
  double sum = 0, peak = 0, least = 0;
  for (std::size_t k = 0; k < coulomb.size(); ++k) {
    peak = std::max(peak, std::abs(coulomb[k].force));
    least = std::min(least, lugre[k].work);
    sum += (lugre[k].force - coulomb[k].force) * (lugre[k].force - coulomb[k].force);
  }
  const double rms = std::sqrt(sum / static_cast<double>(coulomb.size()));
  std::printf("LuGre against Coulomb: RMS difference %.2f %% of the peak of %.2f N\n", 100 * rms / peak, peak);
  EXPECT_LT(rms, 0.05 * peak);
  EXPECT_GT(rms, 1e-4 * peak) << "another model";
  EXPECT_GT(least, -1e-6);
  EXPECT_EQ(lugre.back().punctures, 1U);
}

TEST(NeedleTrack, TissueIsDraggedAlongBeforeTheShaftSlips) {
  const auto samples = run(there_and_back(0.060, 0.050),
                           {.coupling = Coupling::stylet, .tissues = tissue({.friction_per_length = 18})});
  const auto turned = turning_point(samples);
  const auto later = turned + 60;  // 2 mm further back
  std::printf("tip moved back %.2f mm, in the tissue %.2f mm\n", 1e3 * (turned->tip - later->tip),
              1e3 * (turned->depth - later->depth));
  EXPECT_LT(turned->depth - later->depth, 0.5 * (turned->tip - later->tip));
}

TEST(NeedleTrack, TissueThatWasDraggedAlongSpringsBack) {
  reference::ReferenceInsertion insertion = there_and_back(0.050, 0.049);
  if (kSanitized) insertion.haptic_hz = 250;
  reference::ReferenceExperiment experiment(
      insertion, {.coupling = Coupling::stylet, .tissues = tissue({.friction_per_length = 18})});
  const double dt = 1 / insertion.haptic_hz;
  double way = 0;
  const auto go_to = [&](double end, double speed) {
    const double start = way, duration = std::abs(end - start) / speed;
    for (double time = 0; time < duration + 0.4;) {  // and rest there
      experiment.simulation_step();
      for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
        time += dt;
        way = start + (end - start) * std::min(1.0, time / duration);
        physics::StylusPose base = insertion.base(0);
        base.position.x() += way;
        experiment.haptic().step(base, dt, experiment.patch_in_use());
      }
    }
    return experiment.simulation().tissue().positions[0];
  };
  const Eigen::Matrix3Xd rest = experiment.simulation().tissue().positions[0];
  const Eigen::Matrix3Xd in = go_to(0.050, 0.045);
  const Eigen::Matrix3Xd dragged = go_to(0.0495, 0.010);  // less than it takes to slip
  const Eigen::Matrix3Xd released = go_to(0.050, 0.010);
  const Eigen::Matrix3Xd out = go_to(-0.010, 0.045);
  const auto furthest = [](const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
    return (a - b).colwise().norm().maxCoeff();
  };
  const double drag = furthest(dragged, in);
  std::printf("dragged along by 0.5 mm: tissue moved %.3f mm; released: %.1e mm off; needle out: %.1e mm off\n",
              1e3 * drag, 1e3 * furthest(released, in), 1e3 * furthest(out, rest));
  EXPECT_GT(furthest(in, rest), 1e-3);  // on the way in it was dragged too, until the shaft slipped
  EXPECT_GT(drag, 0.2e-3);
  EXPECT_LT(furthest(released, in), 1e-3 * drag);
  EXPECT_LT(furthest(out, rest), 1e-6 * drag);
}

TEST(NeedleTrack, ForceDoesNotDependOnTheHapticRate) {
  std::vector<std::vector<Sample>> at_rate;
  for (const int khz : kSanitized ? std::vector{1, 2} : std::vector{1, 2, 4}) {
    reference::ReferenceInsertion insertion = there_and_back(0.050, 0.030);
    insertion.haptic_hz = 1000.0 * khz;
    std::vector<Sample> all = run(insertion, {.coupling = Coupling::stylet, .tissues = tissue(liver())});
    std::vector<Sample> each_ms;
    for (std::size_t i = static_cast<std::size_t>(khz) - 1; i < all.size(); i += static_cast<std::size_t>(khz)) {
      each_ms.push_back(all[i]);
    }
    at_rate.push_back(each_ms);
  }
  const auto& fine = at_rate.back();
  const auto puncture =
      std::find_if(fine.begin(), fine.end(), [](const Sample& s) { return s.state == TipState::inside; });
  ASSERT_NE(puncture, fine.end());
  double peak = 0;
  for (const Sample& s : fine) peak = std::max(peak, std::abs(s.force));
  for (std::size_t r = 0; r + 1 < at_rate.size(); ++r) {
    double sum = 0;
    int count = 0;
    for (std::size_t k = 0; k < std::min(fine.size(), at_rate[r].size()); ++k) {
      if (std::abs(fine[k].time - puncture->time) < 0.020) continue;
      const double difference = at_rate[r][k].force - fine[k].force;
      sum += difference * difference;
      ++count;
    }
    const double rms = std::sqrt(sum / count);
    std::printf("%d kHz against the fastest: RMS difference %.2f %% of the peak\n", 1 << r, 100 * rms / peak);
    EXPECT_LT(rms, 0.02 * peak);
  }
}

/// How far a tip that is driven 90 mm into a block has come towards the side that its bevel faces, m; what the block
/// does to any tip is left out.
double steered(const physics::ElasticMaterial& material, const physics::InsertionResistance& resistance,
               double bevel_ratio, double speed) {
  double towards_face = 0;
  for (const double roll : {0.0, 180.0}) {
    reference::ReferenceInsertion insertion = there_and_back(0.090, 0.089);
    insertion.material = material;
    insertion.axial_speed = {{0, speed}, {0.090 / speed, speed}};
    insertion.duration = 0.090 / speed;
    reference::ReferenceRun settings{
        .coupling = Coupling::stylet, .track = {.bevel_ratio = bevel_ratio}, .tissues = tissue(resistance)};
    settings.roll_deg = roll;
    reference::ReferenceExperiment experiment(insertion, settings);
    while (experiment.time_s() < insertion.duration) experiment.advance();
    const auto& s = experiment.needle();
    const Eigen::Vector3d facing = s.orientations[0] * Eigen::Vector3d::UnitX();  // the hub does not turn
    towards_face += 0.5 * (s.positions.col(s.node_count - 1) - insertion.tip_start).dot(facing);
  }
  return towards_face;
}

TEST(NeedleTrack, ABevelSteersAwayFromItsFaceInEveryTissue) {
  constexpr double kSpeed = 0.090;
  struct Case {
    const char* name;
    double young_modulus;
    physics::InsertionResistance resistance;
  };
  physics::InsertionResistance skin{.puncture_force = 3, .cutting_force = 1.5, .friction_per_length = 30};
  physics::InsertionResistance fat{.cutting_force = 0.3, .friction_per_length = 5};
  physics::InsertionResistance sticky = liver();
  sticky.friction_coefficient = 0.3;
  sticky.cutting_viscosity = 5;
  for (const Case& c : {Case{"skin", 200e3, skin}, Case{"muscle", 40e3, sticky}, Case{"liver", 6e3, liver()},
                        Case{"fat", 2e3, fat}}) {
    const double aside =
        steered({.young_modulus = c.young_modulus, .poisson_ratio = 0.45}, c.resistance, 0.2, kSpeed);
    std::printf("%s: %.2f mm towards the face\n", c.name, 1e3 * aside);
    EXPECT_LT(aside, -0.3e-3) << c.name;
    EXPECT_NEAR(steered({.young_modulus = c.young_modulus, .poisson_ratio = 0.45}, c.resistance, 0, kSpeed), 0, 1e-7)
        << c.name;
  }
}

TEST(NeedleTrack, ABevelSteersAlikeAtEverySpeed) {
  const physics::ElasticMaterial material{.young_modulus = 6e3, .poisson_ratio = 0.45};
  const double slow = steered(material, liver(), 0.2, 0.010);
  for (const double speed : {0.050, 0.200}) {
    const double fast = steered(material, liver(), 0.2, speed);
    std::printf("10 mm/s: %.3f mm towards the face, %.0f mm/s: %.3f mm\n", 1e3 * slow, 1e3 * speed, 1e3 * fast);
    EXPECT_LT(slow, 0);
    EXPECT_NEAR(fast / slow, 1, 0.1);
  }
}

/// 80 mm in with a bevelled tip, at rest half way for as long as a turn takes.
/// @return where the track lies in the tissue at rest: how deep, and how far towards the side that the bevel faced at
/// first; a point every 5 mm
std::vector<Eigen::Vector2d> bevelled_track(double turn) {
  constexpr double kSpeed = 0.045, kHalf = 0.045;
  constexpr double kTurning = kSanitized ? 2 : 0.5;  // s; a step may turn the hub by no more than its limit
  reference::ReferenceInsertion insertion = there_and_back(0.090, 0.089);
  insertion.contact_spacing = 0.005;
  insertion.material.young_modulus = 40e3;
  insertion.needle.outer_diameter = 0.7e-3;
  insertion.needle.inner_diameter = 0.4e-3;
  insertion.needle.beams = 16;
  if (kSanitized) {
    insertion.nodes_per_edge = 5;
    insertion.haptic_hz = 250;
    insertion.simulation_hz = 25;
  }
  reference::ReferenceExperiment experiment(
      insertion,
      {.coupling = Coupling::stylet, .track = {.bevel_ratio = 0.3}, .tissues = tissue({.cutting_force = 0.94})});
  const double first = kHalf / kSpeed, dt = 1 / insertion.haptic_hz;
  for (double time = 0; time < 2 * first + kTurning;) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      time += dt;
      const double rest = std::clamp(time - first, 0.0, kTurning);
      physics::StylusPose base = insertion.base(0);
      base.position.x() += kSpeed * (time - rest);
      base.orientation *= Eigen::Quaterniond(Eigen::AngleAxisd(turn * rest / kTurning, Eigen::Vector3d::UnitZ()));
      EXPECT_EQ(experiment.haptic().step(base, dt, experiment.patch_in_use()).flags, 0U);
    }
  }
  std::vector<Eigen::Vector2d> track;
  const Eigen::Vector3d facing = insertion.base(0).orientation * Eigen::Vector3d::UnitX();
  const physics::TetMesh& mesh = experiment.simulation().model(0).mesh;
  for (int c = 0; c < experiment.needle().contact_count; ++c) {
    const physics::NeedleContact& contact = experiment.needle().contacts[c];
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      at += contact.barycentric[static_cast<Eigen::Index>(k)] * mesh.nodes[mesh.tets[contact.tet][k]];
    }
    track.emplace_back(at.x(), (at - insertion.tip_start).dot(facing));
  }
  return track;
}

/// Of the parabola through a part of the track: sideways slope at its ends, and second derivative, 1/m.
struct Bend {
  double slope_at_start = 0, slope_at_end = 0, curvature = 0;
};
Bend bend(const std::vector<Eigen::Vector2d>& track, double from, double to) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Eigen::Vector2d& point : track) {
    if (point.x() < from || point.x() > to) continue;
    const double x = (point.x() - from) / (to - from);
    const Eigen::Vector3d row(1, x, x * x);
    normal += row * row.transpose();
    right += row * point.y();
  }
  const Eigen::Vector3d parabola = normal.inverse() * right / (to - from);
  return {parabola[1], parabola[1] + 2 * parabola[2], 2 * parabola[2] / (to - from)};
}

TEST(NeedleTrack, TurnedHalfWayABevelledNeedleCurvesTheOtherWay) {
  const auto never = bevelled_track(0), turned = bevelled_track(std::numbers::pi);
  // Around the turn, half way, the tissue that the shaft pressed aside comes back: left out.
  const Bend first[2] = {bend(never, 0.004, 0.036), bend(turned, 0.004, 0.036)};
  const Bend second[2] = {bend(never, 0.049, 0.086), bend(turned, 0.049, 0.086)};
  for (int t = 0; t < 2; ++t) {
    std::printf("%s: slope %.3f to %.3f, curvature %.2f 1/m; then %.3f to %.3f, %.2f 1/m\n",
                t == 0 ? "never turned" : "turned", first[t].slope_at_start, first[t].slope_at_end,
                first[t].curvature, second[t].slope_at_start, second[t].slope_at_end, second[t].curvature);
  }
  EXPECT_EQ(first[0].curvature, first[1].curvature);  // the same way until then
  EXPECT_LT(first[0].curvature, -1);
  EXPECT_LT(second[0].curvature, -1);
  EXPECT_GT(second[1].curvature, 1);
  // Unturned it bends further and further: the slope grows with depth, all along.
  EXPECT_LT(first[0].slope_at_end, first[0].slope_at_start);
  EXPECT_LT(second[0].slope_at_start, first[0].slope_at_end);
  EXPECT_LT(second[0].slope_at_end, second[0].slope_at_start);
}

TEST(NeedleTrack, PushedAgainstWhatItCannotBreakTheNeedleBucklesAndStaysFinite) {
  reference::ReferenceInsertion insertion = there_and_back(0.060, 0.0);
  insertion.material.young_modulus = 500e3;
  reference::ReferenceExperiment experiment(
      insertion, {.coupling = Coupling::stylet, .tissues = tissue({.puncture_force = 1e3})});
  double most_force = 0, most_bend = 0;
  while (experiment.time_s() < insertion.duration) {
    experiment.advance();
    const auto& s = experiment.needle();
    ASSERT_TRUE(s.positions.leftCols(s.node_count).allFinite());
    most_force = std::max(most_force, s.wrench.force.norm());
    most_bend = std::max(most_bend, std::abs(s.positions(2, 4) - insertion.tip_start.z()) +
                                        std::abs(s.positions(1, 4) - insertion.tip_start.y()));
  }
  // Clamped at the hub, pinned at the tip: 20.19 EI / L^2 = 18.6 N.
  std::printf("at most %.1f N, bent aside by %.1f mm\n", most_force, 1e3 * most_bend);
  EXPECT_GT(most_bend, 5e-3);
  EXPECT_LT(most_force, 1.3 * 18.6);
}

/// Liver with bone behind x = 30 mm.
std::shared_ptr<const physics::TissueMap> liver_before_bone() {
  constexpr int kVoxels = 20;
  auto map = std::make_shared<physics::TissueMap>();
  map->spacing = 0.005;
  map->origin.setConstant(0.5 * map->spacing);
  map->size.setConstant(kVoxels);
  for (int i = 0; i < kVoxels * kVoxels * kVoxels; ++i) {
    map->labels.push_back(i % kVoxels * map->spacing < 0.0299 ? 1 : 2);
  }
  map->tissues = {{}, liver(), {.puncture_force = 100, .cutting_force = 100, .rigid = true}};
  return map;
}

// Into the bone by the way of the hub, out, and again: it stops there, as hard as the needle is, and leaves the
// tissue in peace.
TEST(NeedleTrack, BoneStopsTheNeedleAndBearsItsForce) {
  const auto on_tissue = [](const physics::NeedleState& s) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < s.force_count; ++i) sum += s.forces[i].force;
    return sum;
  };
  reference::ReferenceExperiment experiment(there_and_back(0.045, 0.020),
                                            {.coupling = Coupling::stylet, .tissues = liver_before_bone()});
  struct OnBone {
    double from = 1, to = 0;  // of the tip along x, m
    double force = 0;         // N
  };
  std::array<OnBone, 2> times;
  double most_on_tissue = 0, most_step = 0, before = 0;
  std::size_t turn = 0;
  while (experiment.time_s() < experiment.insertion().duration - 1e-9) {
    experiment.simulation_step();
    for (int i = 0; i < experiment.insertion().haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      const physics::NeedleState& s = experiment.needle();
      const double force = -s.wrench.force.x(), tip = s.positions(0, s.node_count - 1);
      if (times[0].force > 0 && tip < 0.025) turn = 1;
      if (force > 4) {
        times[turn] = {std::min(times[turn].from, tip), std::max(times[turn].to, tip),
                       std::max(times[turn].force, force)};
        most_on_tissue = std::max(most_on_tissue, std::abs(on_tissue(s).x()));
      }
      most_step = std::max(most_step, force < 4 ? std::abs(force - before) : 0.0);
      before = force;
    }
  }
  for (const OnBone& on : times) {
    std::printf("tip between %.3f and %.3f mm, at most %.1f N\n", 1e3 * on.from, 1e3 * on.to, on.force);
    // 120 mm of it are free: between 20.2 and 39.5 EI / L^2, pinned and clamped by the tissue, it buckles.
    EXPECT_GT(on.force, 10);
    EXPECT_LT(on.force, 66);
    EXPECT_LT(on.to - on.from, 2e-4);
  }
  EXPECT_NEAR(times[0].to, 0.030, 2e-4);
  EXPECT_NEAR(times[1].to, 0.030, 2e-4);
  std::printf("at most %.2f N on the tissue meanwhile; steps of up to %.2f N on the way\n", most_on_tissue,
              most_step);
  EXPECT_LT(most_on_tissue, 2);
  EXPECT_EQ(experiment.needle().puncture_count, 1U);
}

TEST(NeedleTrack, TwoRunsGiveTheSameBits) {
  const reference::ReferenceInsertion insertion = there_and_back(0.030, 0.020);
  const reference::ReferenceRun settings{
      .coupling = Coupling::stylet, .tissues = tissue(liver()), .worker_period = 3};
  reference::ReferenceExperiment one(insertion, settings), two(insertion, settings);
  while (one.time_s() < insertion.duration) {
    one.advance();
    two.advance();
  }
  ASSERT_EQ(one.forces().size(), two.forces().size());
  for (std::size_t k = 0; k < one.forces().size(); ++k) ASSERT_EQ(one.forces()[k], two.forces()[k]) << "step " << k;
}

// Slanting, beyond the cone of friction: the tip skids over the surface and bends the needle until it breaks in. What
// it presses on is always where it is, so it breaks in there, and neither a kick nor a swing follows.
TEST(NeedleTrack, TipThatSkidsBreaksInWhereItIs) {
  physics::SimulationBody block;
  block.mesh = reference::kuhn_box({-0.06, -0.02, -0.03}, {0.06, 0.02, 0}, {12, 4, 3});
  block.tet_materials.assign(block.mesh.tets.size(), {.young_modulus = 20e3, .poisson_ratio = 0.45});
  block.fixed_nodes = reference::nodes_where(block.mesh, [](const Eigen::Vector3d& x) { return x.z() < -0.0299; });
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(std::move(block));
  physics::SimulationLoop simulation(std::move(bodies), {.dt = 0.02, .lay_contacts = false});
  physics::TissuePatch patch = simulation.make_patch();

  const Eigen::Vector3d axis = Eigen::Vector3d(std::sqrt(3.0), 0, -1).normalized();
  const physics::NeedleProperties needle = r1().needle;
  physics::StylusPose hub;
  hub.orientation = physics::orientation_along(axis);
  hub.position = Eigen::Vector3d(-0.0301, 0.001, 0) - (needle.length + 0.002) * axis;
  physics::HapticLoopSettings settings;
  settings.needle = needle;
  settings.coupling = Coupling::stylet;
  settings.track.tip_friction = 0.5;
  settings.tissues = tissue({.puncture_force = 0.25, .cutting_force = 0.2, .friction_per_length = 8});
  physics::HapticLoop haptic(settings, hub);

  const double step = 4e-5;  // m: 40 mm/s
  double skid = 0, apart = 0, before = 0, after = 0;
  Eigen::Vector3d met = Eigen::Vector3d::Zero();
  int inside = 0;
  for (int k = 0; k < 1500 && inside < 200; ++k) {
    if (k % 20 == 0) {
      simulation.step({.needle = &haptic.state(), .time_s = 1e-3 * k}, patch);
      simulation.worker().step();
    }
    hub.position += step * axis;
    const physics::NeedleState& s = haptic.step(hub, 1e-3, patch);
    const double force = s.wrench.force.norm();
    if (s.tip == TipState::indenting) {
      const Eigen::Vector3d tip = s.positions.col(s.node_count - 1);
      const physics::NeedleContact& pressed = s.contacts[s.track_count - 1];
      if (before == 0) met = tip;
      skid = (tip - met).head<2>().norm();
      apart = std::max(apart, (tip - pressed.position).norm());
      before = std::max(before, force);
    } else if (s.puncture_count > 0) {
      EXPECT_EQ(s.tip, TipState::inside);
      after = std::max(after, force);
      ++inside;
    }
  }
  std::printf("skids %.1f mm, at most %.2f mm off what it presses on; %.3f N, then at most %.3f N\n", 1e3 * skid,
              1e3 * apart, before, after);
  EXPECT_GT(skid, 8e-3);
  EXPECT_LT(apart, 1e-3);  // 0.57 N on a compliance of 1.1 mm/N, and the slide of a step
  EXPECT_EQ(inside, 200);
  EXPECT_LT(after, 1.1 * before);
}

}  // namespace
}  // namespace stylet::bench
