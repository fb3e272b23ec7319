// What a trainee reads when a session is over and when something cannot be done, in English and in German.
#include "engine/panels/ending.h"

#include "engine/panels/session_facts.h"
#include "engine/procedures/kinds.h"
#include "engine/readers/scenario.h"
#include "engine/readers/texts_file.h"
#include "engine/training/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <string>

namespace stylet::panels {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Ending, HasAdviceAndGermanForEverythingThatTheShippedScenariosScore) {
  const content::Texts german = readers::find_texts("de");
  const auto rows = procedures::metric_table();
  for (const readers::ScenarioEntry& entry : readers::list_scenarios(readers::content_directory() / "scenarios")) {
    std::ifstream file(entry.path);
    const nlohmann::json scenario = nlohmann::json::parse(file);
    for (const auto& criterion : scenario["scoring"]) {
      const std::string metric = criterion["metric"];
      const auto row = std::ranges::find(rows, metric, &content::MetricRow::name);
      ASSERT_NE(row, rows.end()) << metric;
      training::Score score{.done = true};
      score.lines.push_back({.criterion = {.metric = metric}, .title = std::string(row->title), .most = 10});
      const std::string said = advice(score);
      EXPECT_THAT(said, Not(HasSubstr("Most points"))) << entry.name << ": " << metric;
      EXPECT_NE(german.of(said), said) << entry.name << ": " << metric;
      EXPECT_NE(german.of(row->title), row->title) << entry.name;
    }
  }
}

TEST(Ending, OfNothingDoneIsNoBadScoreButNone) {
  training::TrainingReport report;
  report.score = training::Score{.pass_mark = 70, .done = false};
  report.score->lines.push_back({.criterion = {.metric = "targeting"}, .title = "targeting", .most = 10});
  Ending ending = ending_of(report, "");
  EXPECT_EQ(ending.verdict, "Nothing was sampled or treated");
  EXPECT_THAT(ending.advice, HasSubstr("nothing to give points for"));
  translate(ending, readers::find_texts("de"));
  EXPECT_THAT(ending.verdict, HasSubstr("Nichts"));
  EXPECT_THAT(ending.advice, HasSubstr("nichts zu werten"));
}

TEST(SessionFacts, ARefusalIsTranslatedWithItsReason) {
  const content::Texts german = readers::find_texts("de");
  SessionFacts facts{.prompt =
                         "Not now: the tip is outside the patient, 68 mm from the target: there is nothing to "
                         "cut; advance the needle."};
  translate(facts, german);
  EXPECT_EQ(
      facts.prompt,
      "Nicht jetzt: die Spitze ist außerhalb des Patienten, 68 mm vom Ziel: da ist nichts zu schneiden; führe die "
      "Nadel vor.");
}

}  // namespace
}  // namespace stylet::panels
