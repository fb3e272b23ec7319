// The zero of depth: where the needle goes in.
#include "engine/debrief/skin_entry.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stylet::debrief {
namespace {

PathPoint at(double time_s, double x, double z, double inserted) {
  return {.time_s = time_s, .tip = {x, 0, z}, .inserted = inserted};
}

TEST(SkinEntry, IsTheLastMomentBeforeTissue) {
  EXPECT_EQ(skin_entry_s({at(0, 0, 0.03, 0), at(1, 0, 0, 0), at(2, 0, -0.01, 0.012)}), 1);
  EXPECT_EQ(skin_entry_s({at(3, 0, -0.01, 0.012), at(4, 0, 0, 0)}), 3) << "begins in tissue";
  EXPECT_FALSE(skin_entry_s({at(0, 0, 0.03, 0)}));
  EXPECT_FALSE(skin_entry_s({}));
}

// In, out, and in again 40 mm beside: between the two the way out counts, then the way in.
TEST(SkinEntry, DepthOutsideIsTheWayToTheNearerHole) {
  const std::vector<double> depth =
      depth_from_entry({at(0, 0, 0.03, 0), at(1, 0, 0, 0), at(2, 0, -0.05, 0.05), at(3, 0, 0, 0), at(4, 0, 0.01, 0),
                        at(5, 0.04, 0.01, 0), at(6, 0.04, 0, 0), at(7, 0.04, -0.02, 0.02), at(8, 0.04, 0.002, 0),
                        at(9, 0.04, 0.006, 0)});
  const std::vector<double> expected{-0.03, 0, 0.05, 0, -0.01, -0.01, 0, 0.02, 0, -0.004};
  ASSERT_EQ(depth.size(), expected.size());
  for (std::size_t i = 0; i < depth.size(); ++i) EXPECT_NEAR(depth[i], expected[i], 1e-12) << i;
}

TEST(SkinEntry, WithoutOneThereIsNoDepth) {
  for (const double depth : depth_from_entry({at(0, 0, 0.03, 0), at(1, 0, 0.01, 0)})) EXPECT_TRUE(std::isnan(depth));
}

}  // namespace
}  // namespace stylet::debrief
