// The needle of a shipped scenario against its liver.
#include "tools/bench/tissue_parts.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

namespace stylet::bench {
namespace {

TEST(CapsuleBench, TheShippedLiverIsPressedAndBrokenThroughAsTissueIs) {
  const Report report = tissue_capsule({.quick = true});
  std::map<std::string, double> values;
  for (const Measurement& each : report.measurements) {
    std::printf("  %s %.3f %s\n", each.name.c_str(), each.value, each.unit.c_str());
    values[each.name] = each.value;
    EXPECT_TRUE(each.met.value_or(true)) << each.name;
  }
  const std::string key = "capsule.liver_biopsy.";
  EXPECT_GT(values[key + "exponent"], 1.7);
  EXPECT_LT(values[key + "exponent"], 2.2);
  EXPECT_NEAR(values[key + "puncture.force"], 1.8, 0.02);
  EXPECT_LT(values[key + "after"], 1.2);
  EXPECT_GT(values[key + "hysteresis"], 5);
  EXPECT_GT(values[key + "cycle_2.energy"], 0);
}

}  // namespace
}  // namespace stylet::bench
