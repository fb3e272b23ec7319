// A frictionless needle that goes to and fro gets no energy out of what it presses on.
#include "tools/reference/two_blocks.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <utility>

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
