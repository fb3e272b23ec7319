// What a scenario trains: briefing, sampling, hints.
#include "engine/procedures/biopsy/plan.h"
#include "engine/readers/scenario.h"

#include "tests/readers/small_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stylet::readers {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using json = nlohmann::json;
using test::SmallScenario;

TEST(Exercise, IsWhatTheScenarioSays) {
  SmallScenario small;
  EXPECT_EQ(load_scene(small.write()).exercise.plan, nullptr);
  small.scenario["briefing"] = json::parse(R"({"goal": "g", "steps": ["a", "b"], "anatomy": "c"})");
  small.scenario["sampling"] = json::parse(R"({"kind": "biopsy", "auto": true, "samples": 2, "throw_mm": 15})");
  small.scenario["hints"] = json::parse(R"([{"when": {"stage": "procedure", "tip_inside": false,
    "distance_mm": [-5, 10], "force_n": [2, 100]}, "text": "t"}])");
  const content::Exercise exercise = load_scene(small.write()).exercise;
  EXPECT_EQ(exercise.briefing.goal, "g");
  EXPECT_THAT(exercise.briefing.steps, ElementsAre("a", "b"));
  EXPECT_EQ(exercise.briefing.anatomy, "c");
  ASSERT_TRUE(exercise.plan);
  ASSERT_EQ(exercise.plan->kind, "biopsy");
  const auto& biopsy = procedures::biopsy::plan_of(exercise);
  EXPECT_TRUE(biopsy.automatic);
  EXPECT_EQ(biopsy.samples, 2);
  EXPECT_DOUBLE_EQ(biopsy.gun.throw_length, 0.015);
  EXPECT_DOUBLE_EQ(biopsy.gun.notch, 0.010);
  ASSERT_THAT(exercise.hints, SizeIs(1));
  const content::Hint& hint = exercise.hints[0];
  EXPECT_EQ(hint.text, "t");
  EXPECT_EQ(hint.stage, "procedure");
  EXPECT_EQ(hint.tip_inside, std::optional(false));
  EXPECT_FALSE(hint.probe_lifted.has_value());
  EXPECT_TRUE(hint.distance.holds(0.009) && hint.distance.holds(-0.005) && !hint.distance.holds(0.011));
  EXPECT_TRUE(hint.force.holds(2) && !hint.force.holds(1.9));
  EXPECT_TRUE(hint.depth.holds(-1e9) && hint.depth.holds(1e9));
}

TEST(Exercise, SaysWhatIsWrongWithIt) {
  SmallScenario small;
  small.scenario["briefing"] = json::parse(R"({"steps": []})");
  small.scenario["sampling"] = json::parse(R"({"kind": "biopsy", "power_w": 50, "throw_mm": 10, "notch_mm": 12})");
  small.scenario["hints"] =
      json::parse(R"([{"when": {"depth_mm": [9, 3], "stage": "later"}, "text": "t"}, {"text": ""}])");
  const std::vector<std::string> problems = validate(small.write());
  EXPECT_THAT(problems, ::testing::UnorderedElementsAre(
                            HasSubstr("/briefing/goal"), HasSubstr("/sampling/power_w: is for kind ablation only"),
                            HasSubstr("/sampling/notch_mm: is longer than throw_mm"),
                            HasSubstr("/hints/0/when/depth_mm: ends before it begins"),
                            HasSubstr("/hints/0/when/stage"), HasSubstr("/hints/1/when")));
}

}  // namespace
}  // namespace stylet::readers
