// A frictionless needle that goes to and fro gets no energy out of what it presses on.
#include "tools/reference/two_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

namespace stylet::reference {
namespace {

TEST(TwoBlocks, OneBodyGivesTheHandNoEnergy) {
  // Elastic and without friction: the work of a closed cycle is 0 but for what late messages cost, and they must not
  // pay. 0.1 % of peak force x stroke is what rounding and the trapezoid may do.
  for (const auto& [frequency, latency] : {std::pair{1.0, 0.0}, std::pair{2.0, 0.008}, std::pair{4.0, 0.020}}) {
    TwoBlocks blocks({.frequency_hz = frequency, .latency_s = latency, .one_body = true});
    blocks.cycle();
    for (int i = 0; i < 2; ++i) {
      const CycleWork cycle = blocks.cycle();
      std::printf("[ %.0f Hz, %.0f ms ] %.3f %% of %.2f N x %.0f mm\n", frequency, 1e3 * latency, 100 * cycle.share(),
                  cycle.peak_force, 1e3 * cycle.stroke);
      EXPECT_GE(cycle.share(), -1e-3);
      EXPECT_LT(cycle.share(), 0.1);
      EXPECT_GT(cycle.peak_force, 0.3);
    }
    EXPECT_EQ(blocks.needle_flags(), 0U);
    EXPECT_EQ(blocks.simulation_flags(), 0U);
  }
}

TEST(TwoBlocks, PushedOnAnotherTheyGiveTheHandNoEnergyAndDoNotOverlap) {
  // With contact forces that are constant between two simulation steps it is -3 to -15 % and 0.3 to 0.8 mm.
  for (const double gap : {0.0, 0.002}) {  // pressed on each other all the time; meeting and parting in every stroke
    for (const auto& [frequency, latency] : {std::pair{1.0, 0.0}, std::pair{2.0, 0.008}, std::pair{4.0, 0.020}}) {
      const TwoBlocksRun run{.frequency_hz = frequency, .latency_s = latency, .gap = gap};
      TwoBlocks blocks(run);
      blocks.cycle();
      const CycleWork cycle = blocks.cycle();
      double overlap = 0;
      for (long i = 0; i < std::lround(run.haptic_hz / frequency); ++i) {
        blocks.step();
        overlap = std::max(overlap, blocks.report().organs.deepest);
      }
      std::printf("[ %.0f Hz, %.0f ms, %.0f mm apart ] %.3f %% of %.2f N x %.0f mm, overlap %.4f mm\n", frequency,
                  1e3 * latency, 1e3 * gap, 100 * cycle.share(), cycle.peak_force, 1e3 * cycle.stroke, 1e3 * overlap);
      EXPECT_GE(cycle.share(), -1e-3);
      EXPECT_LT(cycle.share(), 0.1);
      if (gap == 0) {
        EXPECT_LT(overlap, 1e-4);
      }
      EXPECT_EQ(blocks.needle_flags() & ~physics::kNeedlePatchLeft, 0U);  // a late patch may end beside the tip

      EXPECT_EQ(blocks.simulation_flags(), 0U);
    }
  }
}

TEST(TwoBlocks, AtRestTheForceIsTheSameHoweverContactIsFollowed) {
  std::vector<double> force;
  for (const bool at_haptic_rate : {false, true}) {
    TwoBlocks blocks({.frequency_hz = 4, .stops_s = 0.6, .at_haptic_rate = at_haptic_rate});
    while (blocks.time_s() < 3) blocks.step();
    force.push_back(blocks.needle().wrench.force.norm());
  }
  std::printf("constant between simulation steps %.9f N, followed %.9f N\n", force[0], force[1]);
  // The tip slides freely, and where on the face it comes to rest depends on its way: by 0.02 mm here.
  EXPECT_NEAR(force[1] / force[0], 1, 1e-3);
}

TEST(TwoBlocks, ForceIsRightAtOnceWhereTheHandStops) {
  // From full speed: what the next simulation steps bring is what is not linear, and what of the last patch has not
  // gone in yet (README eq. 17b).
  TwoBlocks blocks({.frequency_hz = 4, .stops_s = 1.0});
  while (blocks.time_s() < 1.002) blocks.step();
  const double at_once = blocks.needle().wrench.force.norm();
  while (blocks.time_s() < 1.042) blocks.step();
  const double in_two_steps = blocks.needle().wrench.force.norm();
  while (blocks.time_s() < 3) blocks.step();
  const double at_last = blocks.needle().wrench.force.norm();
  std::printf("2 ms after the stop %.5f N, after 42 ms %.5f N, at last %.5f N\n", at_once, in_two_steps, at_last);
  EXPECT_NEAR(at_once / at_last, 1, 0.025);
  EXPECT_NEAR(in_two_steps / at_last, 1, 0.005);
}

TEST(TwoBlocks, MessagesAreAsOldAsAskedFor) {
  // What the simulation consumed is the needle's step of 8 ms before, and its patch is felt 8 ms after.
  TwoBlocks blocks({.latency_s = 0.008});
  for (int i = 0; i < 101; ++i) blocks.step();
  EXPECT_EQ(blocks.report().needle_step, 92U);  // step 100 saw what step 92 published
  EXPECT_EQ(blocks.report().step, 6U);
  EXPECT_EQ(blocks.needle().patch_epoch, 5U);
  for (int i = 0; i < 7; ++i) blocks.step();
  EXPECT_EQ(blocks.needle().patch_epoch, 5U);
  blocks.step();
  EXPECT_EQ(blocks.needle().patch_epoch, 6U);
}

}  // namespace
}  // namespace stylet::reference
