// What holds a needle in tissue, and no more: sideways until it cuts, and about its axis as along it.
#include "tests/physics/needle_track_runs.h"
#include "tools/reference/led_needle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Coupling;
using physics::NeedleState;
using reference::LedNeedle;

/// Hardly bends, so that it goes aside as a whole.
reference::ReferenceInsertion rigid() {
  reference::ReferenceInsertion insertion = r1();
  insertion.needle.young_modulus = 1e14;
  return insertion;
}

reference::ReferenceRun coupled(const physics::InsertionResistance& resistance) {
  return {.coupling = Coupling::stylet, .tissues = tissue(resistance)};
}

// Length times strength, no more and no less, however far it goes.
TEST(NeedleLimits, ANeedleDraggedAsideIsHeldByItsLengthTimesTheStrengthOfTheTissue) {
  constexpr double kStrength = 10, kDepth = 0.06;
  for (const double strength : {0.0, kStrength}) {
    LedNeedle led(rigid(), coupled({.side_strength = strength}));
    led.lead({.along = kDepth}, 0.8);
    std::vector<double> held;
    led.lead({.along = kDepth, .aside = 0.02}, 0.8,
             [&](const NeedleState& s) { held.push_back(std::abs(s.wrench.force.y())); });
    led.lead({.along = kDepth, .aside = 0.02}, 0.4);
    const double most = *std::max_element(held.begin(), held.end());
    const double after = std::abs(led.needle().wrench.force.y());
    std::printf(
        "strength %.0f N/m: at most %.4f N, then %.4f N; cut %.1f mm2, %.4f J, work of the hand %.4f J, flags %u\n",
        strength, most, after, 1e6 * led.needle().damage.side_cut, led.needle().damage.side_work,
        led.needle().hand_work, led.flags());
    if (strength == 0) {
      EXPECT_GT(most, 2 * kStrength * kDepth);
      EXPECT_EQ(led.needle().damage.side_cut, 0);
    } else {
      EXPECT_NEAR(most, kStrength * kDepth, 0.03 * kStrength * kDepth);
      EXPECT_NEAR(after, kStrength * kDepth, 0.05 * kStrength * kDepth);
      EXPECT_NEAR(led.needle().damage.side_work, strength * led.needle().damage.side_cut,
                  1e-3 * led.needle().damage.side_work);
      EXPECT_GT(led.needle().damage.side_cut, 0.3 * 0.02 * kDepth);
    }
    EXPECT_EQ(led.flags(), 0U);
  }
}

// There and back, twice: elastic tissue gives back what it took, cut tissue does not, and nothing ever gives more.
TEST(NeedleLimits, TissueThatIsCutTakesEnergyAndNeverGivesAny) {
  for (const double strength : {0.0, 10.0}) {
    LedNeedle led(rigid(), coupled({.side_strength = strength}));
    led.lead({.along = 0.06}, 0.8);
    led.lead({.along = 0.06}, 0.2);
    const double begin = led.needle().hand_work;
    double least = 0, before = 0;
    const auto watch = [&](const NeedleState& s) {
      least = std::min(least, s.hand_work - begin - s.damage.side_work);
      EXPECT_GE(s.damage.side_work, before);
      before = s.damage.side_work;
    };
    for (const double aside : {0.02, 0.0, -0.01, 0.0}) led.lead({.along = 0.06, .aside = aside}, 0.6, watch);
    led.lead({.along = 0.06}, 0.3, watch);
    const double work = led.needle().hand_work - begin;
    std::printf("strength %.0f N/m: work of the cycle %.3e J, cutting %.3e J, least stored %.1e J\n", strength, work,
                led.needle().damage.side_work, least);
    EXPECT_GT(least, -0.02 * 0.5 * 0.02 * 0.6);  // of the largest force times half the way: steps of the trapezoid
    if (strength == 0) {
      EXPECT_NEAR(work, 0, 0.05 * 0.5 * 0.02 * 0.6);
    } else {
      EXPECT_GT(work, 0.02 * 0.3);
    }
  }
}

// What was cut stays where it is when the needle has gone: the tissue around it is as it was without force.
TEST(NeedleLimits, ATrackThatWasCutAsideStaysThere) {
  LedNeedle led(rigid(), coupled({.side_strength = 10}));
  led.lead({.along = 0.06}, 0.8);
  led.lead({.along = 0.06, .aside = 0.02}, 0.8);
  led.lead({.along = -0.01, .aside = 0.02}, 0.8);
  led.lead({.along = -0.01, .aside = 0.02}, 0.3);
  const NeedleState& s = led.needle();
  ASSERT_GT(s.track_count, 3);
  double least = 1;
  for (int i = 0; i < s.track_count; ++i) {
    EXPECT_LT(s.contacts[i].force.norm(), 1e-9);
    if (s.contacts[i].id != 0) least = std::min(least, s.contacts[i].position.y() - led.hub().position.y());
  }
  std::printf("tracks are %.2f mm off the needle's line now, that of the way in was -20 mm\n", 1e3 * least);
  EXPECT_GT(least, -0.014);
}

// A late patch may lack the track: its points are kept, and what is cut aside meanwhile stays cut.
TEST(NeedleLimits, WhatIsCutAsideWhileThePatchLacksTheTrackStaysThere) {
  LedNeedle led(rigid(), coupled({.side_strength = 10}));
  led.lead({.along = 0.06}, 0.6);
  led.lead({.along = 0.06, .aside = 0.002}, 0.1);
  const physics::TissuePatch whole = led.experiment().patch_in_use();
  physics::TissuePatch lacking = whole;
  lacking.epoch += 1000;
  lacking.bodies[0].node_count = lacking.bodies[0].tet_count = 0;
  physics::StylusPose hub = led.hub();
  const double cut_before = led.needle().damage.side_cut;
  std::vector<int> tets;
  for (int i = 0; i < led.needle().contact_count; ++i) tets.push_back(led.needle().contacts[i].tet);
  for (int i = 0; i < 100; ++i) {
    hub.position.y() += 1e-4;
    led.experiment().haptic().step(hub, 1e-3, lacking);
  }
  const physics::NeedleState& needle = led.needle();
  ASSERT_EQ(needle.contact_count, static_cast<int>(tets.size()));
  for (int i = 0; i < needle.contact_count; ++i)
    EXPECT_EQ(needle.contacts[i].tet, tets[i]);  // where it is known to be
  const int last = needle.contact_count - 2;
  const double force = needle.wrench.force.norm();
  EXPECT_TRUE(needle.positions.leftCols(needle.node_count).allFinite());
  EXPECT_GT(needle.contact_count, 3);
  EXPECT_GT(needle.damage.side_cut, cut_before + 0.5 * 0.06 * 0.01);
  EXPECT_LT(force, 1.1 * 0.06 * 10);  // no more than the strength over its length
  const double aside = needle.contacts[last].position.y();
  led.experiment().haptic().step(hub, 1e-3, whole);
  std::printf("force %.3f N, last point at %.2f mm; with the patch again %.2f mm\n", force, 1e3 * aside,
              1e3 * needle.contacts[last].position.y());
  EXPECT_NEAR(needle.contacts[last].position.y(), aside, 1e-3);
}

// Dragged on until it is out of the body by its side, nothing holds it any more.
TEST(NeedleLimits, ANeedleTornOutOfTheBodySidewaysIsHeldByNothing) {
  constexpr double kStrength = 10, kDepth = 0.06;
  LedNeedle led(rigid(), coupled({.side_strength = kStrength}));
  const NeedleState& s = led.needle();
  led.lead({.along = kDepth}, 0.8);
  double jump = 0;
  Eigen::Vector3d before = s.wrench.force;
  led.lead({.along = kDepth, .aside = 0.12}, 1.6, [&](const NeedleState& now) {
    jump = std::max(jump, (now.wrench.force - before).norm());
    before = now.wrench.force;
  });
  std::printf("60 mm outside: %d contacts, %.2e N, at most %.3f N in 1 ms on the way; cut %.0f mm2\n",
              s.contact_count, s.wrench.force.norm(), jump, 1e6 * s.damage.side_cut);
  EXPECT_EQ(s.contact_count, 0);
  EXPECT_EQ(s.tip, physics::TipState::outside);
  EXPECT_LT(s.wrench.force.norm(), 1e-9);
  EXPECT_LT(jump, 0.2) << "the hold of its length fades while it goes out";
  EXPECT_LT(s.damage.side_cut, kDepth * 0.06) << "there is no more tissue than to the side of the body";
  EXPECT_GT(s.hand_work, s.damage.side_work);
  // Pushed on beside the body and back in at its front: a new puncture, not the old track.
  led.lead({.along = -0.01, .aside = 0.12}, 0.5);
  led.lead({.along = -0.01}, 0.8);
  led.lead({.along = 0.02}, 0.5);
  EXPECT_GT(s.contact_count, 1);
  EXPECT_LT(s.wrench.force.norm(), 0.5);
}

// Half out, cut aside and in again: it goes in where it is, not along the track that it left far beside.
TEST(NeedleLimits, ANeedleThatGoesInAgainFarBesideItsTrackCutsAnew) {
  LedNeedle led(rigid(), coupled({.cutting_force = 0.2, .side_strength = 10}));
  const NeedleState& s = led.needle();
  led.lead({.along = 0.07}, 0.8);
  led.lead({.along = 0.03}, 0.5);
  led.lead({.along = 0.03, .aside = 0.04}, 0.8);
  double farthest = 0, jump = 0;
  Eigen::Vector3d before = s.wrench.force;
  led.lead({.along = 0.07, .aside = 0.04}, 0.8, [&](const NeedleState& now) {
    for (int i = 0; i < now.contact_count; ++i)
      farthest = std::max(farthest, (now.contacts[i].position - led.hub().position).tail<2>().norm());
    jump = std::max(jump, (now.wrench.force - before).norm());
    before = now.wrench.force;
  });
  std::printf("contacts at most %.1f mm beside the needle, %.3f N in 1 ms\n", 1e3 * farthest, jump);
  EXPECT_LT(farthest, 0.02);
  EXPECT_LT(jump, 0.2);
  EXPECT_GT(s.contact_count, 5);
  EXPECT_GT(s.tip_depth, 0.06);
}

// Cut aside into other tetrahedra and then kept, for a patch that lacks it: its force is still on the nodes around
// it.
TEST(NeedleLimits, APointThatWasCutAsideAndIsKeptPressesOnTheNodesAroundIt) {
  LedNeedle led(rigid(), coupled({.side_strength = 10}));
  led.lead({.along = 0.06}, 0.6);
  led.lead({.along = 0.06, .aside = 0.03}, 0.6);
  physics::TissuePatch lacking = led.experiment().patch_in_use();
  lacking.epoch += 1000;
  lacking.bodies[0].node_count = lacking.bodies[0].tet_count = 0;
  const NeedleState& s = led.experiment().haptic().step(led.hub(), 1e-3, lacking);
  ASSERT_GT(s.force_count, 0);
  const auto& topology = led.experiment().simulation().model(0).topology;
  for (int i = 0; i < s.force_count; ++i) {
    bool around = false;
    for (int c = 0; c < s.contact_count; ++c) {
      const auto& nodes = topology.nodes(s.contacts[c].tet);
      around = around || std::find(nodes.begin(), nodes.end(), s.forces[i].node) != nodes.end();
    }
    EXPECT_TRUE(around) << "node " << s.forces[i].node;
  }
}

// A needle that presses on nothing beyond its strength does not know of it, to the bit.
TEST(NeedleLimits, AStrengthThatIsNotReachedChangesNothing) {
  const auto forces = [](double strength) {
    physics::InsertionResistance resistance = liver();
    resistance.side_strength = strength;
    reference::ReferenceExperiment experiment(r1(), coupled(resistance));
    while (experiment.time_s() < 1.2) experiment.advance();
    return experiment.forces();
  };
  const auto without = forces(0), with = forces(164);
  for (std::size_t k = 0; k < with.size(); ++k) ASSERT_EQ((with[k] - without[k]).norm(), 0) << k;
}

constexpr double kRadius = 0.5 * 1.27e-3;

double turn_of(const NeedleState& s, int node) {
  const Eigen::Quaterniond q = s.orientations[node];
  const Eigen::Vector3d x = q * Eigen::Vector3d::UnitX();
  const Eigen::Quaterniond none = physics::orientation_along(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d x0 = none * Eigen::Vector3d::UnitX(), y0 = none * Eigen::Vector3d::UnitY();
  return std::atan2(x.dot(y0), x.dot(x0));
}

// Friction f along the length L in tissue: once all of it slides, the moment is r f L, and the twist in the tissue is
// r f L^2 / (2 G J), on top of r f L / (G J) times what is outside.
TEST(NeedleLimits, AShaftThatIsTurnedWindsUpByItsFriction) {
  constexpr double kFriction = 500, kDepth = 0.08;
  reference::ReferenceInsertion insertion = r1();
  insertion.material.young_modulus = 1e7;  // the tissue hardly goes round with the shaft
  LedNeedle led(insertion, coupled({.friction_per_length = kFriction}));
  led.lead({.along = kDepth}, 1.0);
  led.lead({.along = kDepth}, 0.2);
  const NeedleState& s = led.needle();
  const double in_tissue = kDepth - 0.0005;
  EXPECT_NEAR(s.wrench.moment.x(), 0, 1e-9);
  led.lead({.along = kDepth, .roll = 1.5}, 1.5);
  const double g = insertion.needle.young_modulus / 2.6;
  const double j = std::numbers::pi / 2 * (std::pow(kRadius, 4) - std::pow(0.5 * 0.838e-3, 4));
  const double moment = kRadius * kFriction * in_tissue;
  const double twist = moment * in_tissue / (2 * g * j) + moment * (0.15 - in_tissue) / (g * j);
  const double seen = turn_of(s, 0) - turn_of(s, s.node_count - 1);
  std::printf("moment %.5f N m (%.5f), hub ahead of the tip by %.4f rad (%.4f), flags %u\n", -s.wrench.moment.x(),
              moment, seen, twist, led.flags());
  EXPECT_NEAR(-s.wrench.moment.x(), moment, 0.03 * moment);
  EXPECT_NEAR(seen, twist, 0.05 * twist);
  EXPECT_EQ(led.flags(), 0U);
  // Let go of, in steps back: the shaft unwinds and is held the other way.
  led.lead({.along = kDepth, .roll = 0}, 1.5);
  EXPECT_NEAR(s.wrench.moment.x(), moment, 0.03 * moment);
  EXPECT_GT(s.hand_work, 0);
}

// Coulomb friction of the shaft's surface acts against its motion: half along and half round, it is a share of
// 1/sqrt(2) of its bound either way; turned fast, the needle goes in easily.
TEST(NeedleLimits, AlongAndRoundFrictionIsOneForceAgainstTheMotion) {
  constexpr double kFriction = 50, kSpeed = 0.0015;
  struct Seen {
    double force = 0, moment = 0, depth = 0;
  };
  const auto seen = [&](double around) {  // speed of the surface, m/s
    reference::ReferenceInsertion insertion = rigid();
    insertion.material.young_modulus = 1e6;
    LedNeedle led(insertion, coupled({.friction_per_length = kFriction}));
    led.lead({.along = 0.05}, 1.0);
    const double seconds = 0.6;
    Seen sum;
    int samples = 0;
    // Smooth way of both, in proportion at any time.
    led.lead({.along = 0.05 + kSpeed * seconds, .roll = around / kRadius * seconds}, seconds,
             [&, step = 0](const NeedleState& s) mutable {
               if (++step < 250 || step > 450) return;
               sum.force -= s.wrench.force.x();
               sum.moment -= s.wrench.moment.x();
               sum.depth += s.tip_depth;
               ++samples;
             });
    EXPECT_EQ(led.flags(), 0U);
    EXPECT_GT(led.needle().hand_work, 0);
    return Seen{sum.force / samples, sum.moment / samples, sum.depth / samples};
  };
  for (const double around : {0.0, 1.0, 5.0}) {
    const Seen s = seen(around * kSpeed);
    const double bound = kFriction * s.depth, speed = std::hypot(1.0, around);
    std::printf("round %.0f times as fast as along: %.3f of the bound along, %.3f round\n", around, s.force / bound,
                s.moment / (kRadius * bound));
    EXPECT_NEAR(s.force / bound, 1 / speed, 0.04);
    EXPECT_NEAR(s.moment / (kRadius * bound), around / speed, 0.04);
  }
}

}  // namespace
}  // namespace stylet::bench
