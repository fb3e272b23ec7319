// `stylet bench tissue`, section speed: that it measures what it says. How fast a machine is, is no test.
#include "tests/support/sanitized.h"
#include "tools/bench/tissue_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

namespace stylet::bench {
namespace {

TEST(TissueSpeed, ComparesTwoWaysToOneEquilibriumAndOneCompliance) {
  if (support::kSanitized) GTEST_SKIP() << "long with a sanitizer; it runs what the tests of physics run";
  std::map<std::string, Measurement> measured;
  for (const Measurement& measurement : tissue_speed({.quick = true}).measurements) {
    EXPECT_TRUE(measured.emplace(measurement.name, measurement).second) << "twice: " << measurement.name;
    EXPECT_TRUE(std::isfinite(measurement.value) && measurement.value >= 0) << measurement.name;
  }
  const auto of = [&](const std::string& name) {
    EXPECT_TRUE(measured.contains(name)) << name;
    return measured[name];
  };
  EXPECT_EQ(of("speed.729_nodes.equilibrium.error").met, true) << of("speed.729_nodes.equilibrium.error").value;
  EXPECT_EQ(of("speed.729_nodes.w_bar.error").met, true) << of("speed.729_nodes.w_bar.error").value;
  EXPECT_GT(of("speed.729_nodes.w_bar.error").value, 0) << "two ways to make the numbers";
  EXPECT_EQ(of("speed.729_nodes.tetrahedra").value, 3072);
  EXPECT_LT(of("speed.729_nodes.passes.memory").value, of("speed.729_nodes.factor.memory").value);
  for (const char* name : {"step.median", "step.p99", "factorisation", "passes.median", "passes.bandwidth"}) {
    EXPECT_GT(of(std::string("speed.729_nodes.") + name).reference.value_or(0), 0) << name;
  }
  EXPECT_GT(of("speed.729_nodes.factorisation.rate").value, 0);
  EXPECT_GT(of("speed.stream.two_threads").value, 0);
}

}  // namespace
}  // namespace stylet::bench
