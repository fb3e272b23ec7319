// Course files: what is shipped, what is refused and warned of, and damaged ones.
#include "engine/lab/course/course_file.h"
#include "engine/files/json_reader.h"
#include "engine/procedures/kinds.h"
#include "tests/readers/generated_files.h"
#include "tests/readers/schema_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace stylet::lab::course {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";
const std::filesystem::path kShipped = kContent / "courses" / "needle_basics.json";

json shipped() {
  const files::JsonFile file(kShipped);
  return file.tree();
}

struct Read {
  Course course;
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
};

Read read(const json& tree) {
  Read result;
  files::JsonFile file(kShipped, tree.dump());
  result.course = read_course(file, &result.warnings);
  result.problems = file.problems();
  return result;
}

TEST(CourseFile, RatesMayBeJustAsCloseAsTheyMay) {
  json tree = shipped();
  json& gate = tree["exercises"][0]["gate"];
  const auto closest = [&](double acceptable, double unacceptable) {
    gate["acceptable_failure_rate"] = acceptable;
    gate["unacceptable_failure_rate"] = unacceptable;
    return read(tree).problems;
  };
  EXPECT_THAT(closest(0.1, 0.15), Not(Contains(HasSubstr("less than")))) << "0.15 < 1.5 * 0.1 in binary";
  EXPECT_THAT(closest(0.1, 0.149), Contains(HasSubstr("less than")));
}

TEST(CourseFile, TheShippedOneGoesFromPhantomToAblation) {
  const Read result = read(shipped());
  EXPECT_THAT(result.problems, IsEmpty());
  EXPECT_THAT(result.warnings, IsEmpty());
  const Course& course = result.course;
  EXPECT_EQ(course.name, "needle_basics");
  EXPECT_EQ(find_course("needle_basics"), kShipped);
  ASSERT_EQ(course.exercises.size(), 4u);
  EXPECT_EQ(course.exercises.front().scenario.stem(), "tutorial");
  EXPECT_EQ(course.exercises.back().scenario.stem(), "rfa");
  // Every scenario that is shipped is in it, but for the one that is another again on a finer mesh.
  int scenarios = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kContent / "scenarios")) {
    if (entry.path().extension() != ".json" || entry.path().stem() == "liver_biopsy_fine") continue;
    ++scenarios;
    EXPECT_TRUE(std::ranges::any_of(course.exercises, [&](const Exercise& exercise) {
      return std::filesystem::equivalent(exercise.scenario, entry.path());
    })) << entry.path();
  }
  EXPECT_EQ(scenarios, 4);
  for (const Exercise& exercise : course.exercises) {
    EXPECT_DOUBLE_EQ(exercise.gate.limit, 3.52) << "0.10 against 0.30 within 30: computed, in no file";
    EXPECT_LE(exercise.gate.false_discovery, 0.05);
    ASSERT_TRUE(exercise.monitoring);
    EXPECT_GT(exercise.monitoring->limit, 2.5);
  }
  EXPECT_THAT(gate_words(course.exercises[0]), HasSubstr("gate at 3.52 within 30 attempts"));
  EXPECT_THAT(gate_words(course.exercises[0]), HasSubstr("with probability 0.716"));
}

TEST(CourseFile, SaysWhatIsWrongAndWhere) {
  const struct {
    std::function<void(json&)> change;
    const char* place;
    const char* what;
  } cases[]{
      {[](json& e) { e[1]["after"] = {"ablation"}; }, "/exercises/1", "ablation is no exercise before this one"},
      {[](json& e) { e[3]["name"] = "phantom"; }, "/exercises/3/name", "is taken"},
      {[](json& e) { e[0]["focus"] = "needle_in_bem"; }, "/exercises/0/focus", "did you mean needle_in_beam?"},
      {[](json& e) { e[0]["scenario"] = "../scenarios/none.json"; }, "/exercises/0/scenario", ""},
      {[](json& e) { e[0]["gate"]["unacceptable_failure_rate"] = 0.12; },
       "/exercises/0/gate/unacceptable_failure_rate", "further apart"},
      {[](json& e) { e[0]["gate"]["attempts"] = 5; }, "/exercises/0/gate/attempts", "too few"},
      {[](json& e) { e[0]["gate"]["limit"] = 2; }, "/exercises/0/gate/limit", "is not a known key"},
      {[](json& e) { e[0]["gate"]["source"] = ""; }, "/exercises/0/gate/source", "source"},
      {[](json& e) { e[1]["retention"][0]["after_days"] = 400; }, "/exercises/1/retention", "sort them"},
      {[](json& e) {
         e[0]["bars"] = {
             {{"metric", "targeting"}, {"method", "angoff"}, {"people", 9}, {"date", "2026-02-01"}, {"source", "x"}}};
       },
       "/exercises/0/bars/0", "exactly one of at_most and at_least"},
      {[](json& e) {
         e[0]["bars"] = {{{"metric", "targeting"},
                          {"at_most", 3},
                          {"method", "angoff"},
                          {"people", 9},
                          {"date", "2026-13-01"},
                          {"source", "x"}}};
       },
       "/exercises/0/bars/0/date", "YYYY-MM-DD"},
  };
  for (const auto& wrong : cases) {
    json tree = shipped();
    wrong.change(tree["exercises"]);
    const Read result = read(tree);
    ASSERT_THAT(result.problems, testing::SizeIs(1)) << wrong.place << testing::PrintToString(result.problems);
    EXPECT_THAT(result.problems[0], HasSubstr(std::string("needle_basics.json:") + wrong.place));
    EXPECT_THAT(result.problems[0], HasSubstr(wrong.what));
  }
}

TEST(CourseFile, WarnsOfVagueBarsAndOfGatesThatStopTheCompetent) {
  json tree = shipped();
  json& exercise = tree["exercises"][0];
  exercise["bars"] = {{{"metric", "elapsed_time"},
                       {"at_most", 90},
                       {"method", "expert_mean"},
                       {"people", 4},
                       {"attempts", 12},
                       {"date", "2026-02-01"},
                       {"source", "our own"}}};
  exercise["gate"]["attempts"] = 20;
  exercise["gate"]["false_discovery"] = 0.01;
  const Read result = read(tree);
  EXPECT_THAT(result.problems, IsEmpty());
  ASSERT_THAT(result.warnings, testing::SizeIs(2));
  EXPECT_THAT(result.warnings[0], HasSubstr("/exercises/0/gate"));
  EXPECT_THAT(result.warnings[0], HasSubstr("stops more of the competent than it passes"));
  EXPECT_THAT(result.warnings[1], HasSubstr("/exercises/0/bars/0"));
  EXPECT_THAT(result.warnings[1], HasSubstr("4 people is vague"));
  const Bar& bar = result.course.exercises[0].bars[0];
  EXPECT_EQ(bar.at_most, 90);
  EXPECT_FALSE(bar.at_least);
}

TEST(CourseFile, SchemaReadmeAndReaderAgree) {
  readers::test::expect_generated(kContent, course_format());
  json tree = shipped();
  tree["exercises"][0]["bars"] = json::array({json::object()});
  readers::test::expect_schema_agrees(kContent / "schemas" / "course.schema.json", kShipped, tree.dump(), 7,
                                      [](files::JsonFile& file) { read_course(file); });
}

TEST(CourseFile, NoDamageCrashesOrHangs) {
  const std::string sound = shipped().dump();
  std::mt19937 random(5);
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  static const std::string kNasty[]{"-1", "0", "1e308", "4294967295", "[", "{", "\"", "null", "0.5", "0.011", ","};
  int clean = 0;
  int refused = 0;
  for (int i = 0; i < 600; ++i) {
    std::string bytes = sound;
    for (std::size_t edits = 1 + pick(3); edits > 0; --edits) {
      const std::size_t at = pick(bytes.size());
      const std::size_t digit = std::min(bytes.find_first_of("0123456789", at), bytes.size() - 1);
      switch (pick(4)) {
        case 0:
          bytes[at] = static_cast<char>(bytes[at] ^ (1 << pick(8)));
          break;
        case 1:
          bytes.erase(at, pick(8));
          break;
        case 2:
          bytes.replace(at, pick(8), kNasty[pick(std::size(kNasty))]);
          break;
        default:
          bytes.replace(digit, 1 + pick(3), kNasty[pick(std::size(kNasty))]);
      }
    }
    try {
      files::JsonFile file(kShipped, bytes);
      const Course course = read_course(file);
      for (const std::string& problem : file.problems()) {
        ASSERT_EQ(problem.find('\n'), std::string::npos) << problem;
      }
      if (file.problems().empty()) {
        ++clean;
        for (const Exercise& exercise : course.exercises) ASSERT_GT(exercise.gate.limit, 0);
      } else {
        ++refused;
      }
    } catch (const files::ContentError&) {
      ++refused;
    }
  }
  EXPECT_GT(clean, 20);
  EXPECT_GT(refused, 150);
}

}  // namespace
}  // namespace stylet::lab::course
