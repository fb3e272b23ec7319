// A needle that is as thin as it is, pressed into liver with a capsule: the force rises as real liver's does.
#include "tools/reference/liver_block.h"

#include "physics/contact/subgrid_compliance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::reference {
namespace {

constexpr double kSpeed = 3e-3;       // m/s
constexpr double kRadius = 0.635e-3;  // m

/// Coarse, and the tip at the face.
LiverBlockSettings small_block() {
  LiverBlockSettings settings;
  settings.cells_across = 6;
  settings.cells_deep = 4;
  settings.gap = 0;
  return settings;
}

// Beside Boussinesq's punch: the same at no force, and with force ever less; a capsule alone makes F ~ d^3.
TEST(LiverBlock, TheTipsNearFieldStiffensFromBoussinesqOn) {
  physics::SubgridSite site{.tet_volume = 1e-6,
                            .material = {.young_modulus = 6e3, .poisson_ratio = 0.49},
                            .barycentric = Eigen::Vector4d(1, 1, 1, 0) / 3};
  const double linear = physics::surface_tip_compliance(site, kRadius);
  EXPECT_EQ(physics::stiffened_tip_compliance(site, kRadius, 1), linear);
  site.material.stiffening = 8;
  site.capsule = 500;
  EXPECT_EQ(physics::stiffened_tip_compliance(site, kRadius, 0), linear);
  EXPECT_NEAR(physics::stiffened_tip_compliance(site, kRadius, 1e-5) / linear, 1, 1e-3);
  double before = 0;
  for (const double force : {0.01, 0.1, 0.3, 1.0, 3.0}) {  // the depth grows, ever less than the force
    const double depth = force * physics::stiffened_tip_compliance(site, kRadius, force);
    EXPECT_GT(depth, before);
    if (before > 0) {
      EXPECT_LT(depth / force, 0.95 * linear);
    }
    before = depth;
  }
  site.material = {.young_modulus = 1, .poisson_ratio = 0.49};
  const auto depth = [&](double force) { return force * physics::stiffened_tip_compliance(site, kRadius, force); };
  EXPECT_NEAR(std::log2(depth(2e-2) / depth(1e-2)), 1.0 / 3, 0.05);
}

// Behind its own capsule too, at the end of a channel.
TEST(LiverBlock, TheEndOfAChannelStiffensWithoutTheCapsule) {
  physics::SubgridSite site{.tet_volume = 1e-6, .material = {.young_modulus = 6e3, .poisson_ratio = 0.49}};
  const double linear = physics::channel_tip_compliance(site, kRadius);
  const auto compliance = [&](double force) {
    return physics::stiffened_channel_compliance(site, kRadius, force) / linear;
  };
  site.capsule = 500;
  EXPECT_EQ(compliance(1), 1);
  site.material.stiffening = 14;
  EXPECT_EQ(compliance(0), 1);
  EXPECT_NEAR(compliance(1e-5), 1, 1e-3);
  EXPECT_LT(compliance(0.1), 0.5);
  EXPECT_LT(compliance(0.3), compliance(0.1));
  EXPECT_GT(0.3 * compliance(0.3), 0.1 * compliance(0.1));
  const double capsule = compliance(0.3);
  site.capsule = 0;
  EXPECT_EQ(compliance(0.3), capsule);
}

TEST(LiverBlock, ForceIsConvexUntilTheCapsuleBreaks) {
  LiverBlock block(small_block());
  block.go(kSpeed, 5);
  std::vector<double> depth;
  std::vector<double> force;
  double after = 0;
  for (const LiverBlock::Sample& sample : block.samples()) {
    if (sample.inside) {
      after = sample.force;
      break;
    }
    depth.push_back(sample.travel);
    force.push_back(sample.force);
  }
  ASSERT_EQ(block.needle().puncture_count, 1U);
  const double exponent = force_exponent(depth, force);
  std::printf("  breaks at %.1f mm with %.2f N, then %.2f N; F ~ d^%.2f\n", 1e3 * depth.back(), force.back(), after,
              exponent);
  EXPECT_GE(exponent, 1.7);
  EXPECT_LE(exponent, 2.2);
  EXPECT_LT(after, 0.5 * force.back());
  EXPECT_EQ(block.needle().flags, 0U);
}

// The channel that a broken surface becomes is of the tissue as it is strained there, not as it was met: else the row
// is another one as soon as the tip cuts, and kicks.
TEST(LiverBlock, OnceTheCapsuleBreaksTheForceFallsAndDoesNotComeBack) {
  LiverBlockSettings settings = small_block();
  settings.gap = 0.002;
  settings.simulation_hz = settings.haptic_hz;  // samples of every haptic step
  settings.resistance.puncture_force = 1.8;
  settings.resistance.cutting_force = 0.94;
  settings.resistance.cutting_viscosity = 2;
  settings.material.stiffening = 40;
  LiverBlock block(settings);
  while (block.needle().puncture_count == 0 && block.samples().size() < 2000) block.go(20e-3, 0.001);
  ASSERT_EQ(block.needle().puncture_count, 1U);
  double before = block.samples().back().force;
  const double broken = before;
  double rise = 0;
  for (int i = 0; i < 30; ++i) {
    block.go(20e-3, 0.001);
    rise = std::max(rise, block.samples().back().force - before);
    before = block.samples().back().force;
  }
  std::printf("  %.2f N, 30 ms later %.2f N; rises by %.1f mN in 1 ms\n", broken, before, 1e3 * rise);
  EXPECT_LT(before, 0.7 * broken);
  EXPECT_LT(rise, 0.01);
}

// Where tissue spreads the load of the tip itself, no larger area than the needle's own is made up for it.
TEST(LiverBlock, ThatWhichStiffensIsPressedByTheNeedlesOwnTip) {
  const auto pressed = [](double stiffening, double capsule, double tip_radius) {
    LiverBlockSettings settings = small_block();
    settings.material.stiffening = stiffening;
    settings.capsule = capsule;
    settings.tip_radius = tip_radius;
    LiverBlock block(settings);
    block.go(kSpeed, 0.5);
    return block.samples().back().force;
  };
  EXPECT_EQ(pressed(14, 600, 5e-3), pressed(14, 600, kRadius));
  EXPECT_EQ(pressed(14, 0, 5e-3), pressed(14, 0, kRadius));
  EXPECT_NE(pressed(0, 0, 5e-3), pressed(0, 0, kRadius)) << "nothing else spreads the load";
}

// What holds the tip then is the force that cuts, and what holds the shaft its friction; the patch goes with the tip.
TEST(LiverBlock, OnceThroughTheCapsuleTheTipCutsAndTheShaftRubs) {
  const LiverBlockSettings settings = small_block();
  LiverBlock block(settings);
  const double cutting = settings.resistance.cutting_force;
  double least = 1;
  while (block.samples().empty() || block.samples().back().travel < 0.0165) {
    block.go(kSpeed, 0.02);
    if (block.samples().back().inside) least = std::min(least, block.samples().back().force);
    EXPECT_EQ(block.needle().flags, 0U) << block.samples().back().travel;
  }
  ASSERT_EQ(block.needle().puncture_count, 1U);
  const double last = block.samples().back().force;
  const double rubs = settings.resistance.friction_per_length * block.needle().tip_depth;
  std::printf("  least %.3f N, then %.3f N, %.1f mm of shaft inside\n", least, last, 1e3 * block.needle().tip_depth);
  EXPECT_GT(least, 0.95 * cutting);
  EXPECT_LT(least, 1.2 * cutting);
  EXPECT_GT(rubs, 0.1);
  EXPECT_NEAR(last, cutting + rubs, 0.05);
}

TEST(LiverBlock, UnloadedItGivesLessBackThanItTook) {
  LiverBlock block(small_block());
  block.go(kSpeed, 2);
  const double pressed = block.samples().back().force;
  ASSERT_GT(pressed, 0.1);
  block.go(0, 10);
  const double held = block.samples().back().force;
  std::printf("  %.3f N, 10 s later %.3f N\n", pressed, held);
  EXPECT_LT(held, 0.8 * pressed);
  EXPECT_GT(held, 0.6 * pressed);
  const double work = block.needle().hand_work;
  block.go(-kSpeed, 2);
  const double left = block.needle().hand_work;
  std::printf("  work in %.3f mJ, left when it is back %.3f mJ\n", 1e3 * work, 1e3 * left);
  EXPECT_GT(left, 0.1 * work);
  EXPECT_EQ(block.needle().puncture_count, 0U);
}

}  // namespace
}  // namespace stylet::reference
