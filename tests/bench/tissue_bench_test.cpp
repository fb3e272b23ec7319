// What `stylet bench tissue` says of the elements by themselves.
#include "tools/bench/scenario_variant.h"
#include "tools/bench/tissue_parts.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace stylet::bench {
namespace {

using physics::Element;

std::map<std::string, double> values_of(const Report& report) {
  std::map<std::string, double> values;
  for (const Measurement& each : report.measurements)
    EXPECT_TRUE(values.emplace(each.name, each.value).second) << "twice: " << each.name;
  return values;
}

TEST(TissueBench, OnlyTheQuadraticBarBendsWhereVolumeStays) {
  const Report report = tissue_cantilever({});
  EXPECT_EQ(report.missed(), 0);
  std::map<std::string, double> values = values_of(report);
  ASSERT_EQ(values.size(), 8u);
  for (const char* ratio : {"0.3", "0.45", "0.49", "0.499"})
    EXPECT_NEAR(values[std::string("cantilever.nu_") + ratio + ".quadratic"], 1, 0.03) << ratio;
  EXPECT_NEAR(values["cantilever.nu_0.45.linear"], 0.306, 0.01);
  EXPECT_LT(values["cantilever.nu_0.499.linear"], 0.1);
}

TEST(TissueBench, AnElementMovesRigidlyInSixWaysAndIsTiedByVolumeInOne) {
  const Report report = tissue_elements({.quick = true});
  EXPECT_EQ(report.missed(), 0);
  std::map<std::string, double> values = values_of(report);
  for (const std::string nu : {"elements.nu_0.3.", "elements.nu_0.499."}) {
    EXPECT_EQ(values[nu + "one.without_energy"], 6);
    EXPECT_EQ(values[nu + "cube.without_energy"], 6);
    EXPECT_GT(values[nu + "one.softest"], 0.01);
  }
  EXPECT_NEAR(values["elements.nu_0.499.one.softest"] / values["elements.nu_0.3.one.softest"], 1, 0.2)
      << "what keeps the volume goes with mu alone";
  EXPECT_GT(values["elements.nu_0.499.one.stiffest"], 50 * values["elements.nu_0.3.one.stiffest"]);
}

TEST(TissueBench, AScenarioIsMeshedOtherwise) {
  const content::Scene linear = scenario_variant("tutorial", {.element = Element::linear, .poisson_ratio = 0.45});
  const content::Scene quadratic =
      scenario_variant("tutorial", {.element = Element::quadratic, .poisson_ratio = 0.49});
  ASSERT_EQ(linear.bodies.size(), quadratic.bodies.size());
  EXPECT_EQ(quadratic.bodies[0].element, Element::quadratic);
  EXPECT_NEAR(static_cast<double>(quadratic.bodies[0].mesh.nodes.size()) /
                  static_cast<double>(linear.bodies[0].mesh.nodes.size()),
              1, 0.15);
  for (const physics::ElasticMaterial& material : quadratic.bodies[0].tet_mechanics)
    ASSERT_EQ(material.poisson_ratio, 0.49);
}

}  // namespace
}  // namespace stylet::bench
