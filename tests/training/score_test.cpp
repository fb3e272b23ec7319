// Points: linear between the thresholds, weighted, with a pass mark and critical failures.
#include "engine/training/score.h"
#include "engine/procedures/ablation/outcome.h"
#include "engine/procedures/biopsy/core.h"
#include "engine/procedures/biopsy/plan.h"
#include "engine/training/training_report.h"

#include "tests/training/event_words.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::training {
namespace {

Metric& metric(std::vector<Metric>& metrics, std::string_view key) {
  return find_metric(std::span<Metric>(metrics), key);
}

struct Scored {
  content::Scene scene;
  std::vector<Metric> metrics = measure({}, scene);

  Scored() {
    scene.scoring = {{.metric = "targeting", .full = 2, .zero = 10, .weight = 3},        // less is better
                     {.metric = "tumour_content", .full = 80, .zero = 20, .weight = 1},  // more is better
                     {.metric = "forbidden_hits", .full = 0, .zero = 1, .weight = 0, .critical = true}};
    scene.pass_mark = 60;
    metric(metrics, "targeting").value = 2;
    metric(metrics, "tumour_content").value = 80;
    metric(metrics, "forbidden_hits").value = 0;
  }
  Score score() const { return *training::score(metrics, scene, true); }
};

TEST(Score, IsFullAndZeroAtTheThresholdsAndLinearBetween) {
  Scored s;
  EXPECT_DOUBLE_EQ(s.score().total, 100);
  EXPECT_TRUE(s.score().passed);
  metric(s.metrics, "targeting").value = 0;
  EXPECT_DOUBLE_EQ(s.score().total, 100) << "better than full is full";
  metric(s.metrics, "targeting").value = 4;
  EXPECT_DOUBLE_EQ(s.score().total, 75 * 0.75 + 25);
  EXPECT_DOUBLE_EQ(s.score().lines[0].points, 75 * 0.75);
  EXPECT_DOUBLE_EQ(s.score().lines[0].most, 75);
  metric(s.metrics, "tumour_content").value = 35;
  EXPECT_DOUBLE_EQ(s.score().total, 75 * 0.75 + 25 * 0.25);
  metric(s.metrics, "targeting").value = 10;
  metric(s.metrics, "tumour_content").value = 0;
  EXPECT_DOUBLE_EQ(s.score().total, 0);
  EXPECT_FALSE(s.score().failed_critical) << "no points there are no critical failure";
}

TEST(Score, PassesFromItsMarkOn) {
  Scored s;
  metric(s.metrics, "tumour_content").value = 0;
  metric(s.metrics, "targeting").value = 2 + 8 * 0.2;  // 60 of 75
  EXPECT_NEAR(s.score().total, 60, 1e-9);
  s.scene.pass_mark = 60.1;
  EXPECT_FALSE(s.score().passed);
  s.scene.pass_mark = 59.9;
  EXPECT_TRUE(s.score().passed);
}

TEST(Score, OneCriticalFailureFailsAll) {
  Scored s;
  metric(s.metrics, "forbidden_hits").value = 1;
  EXPECT_DOUBLE_EQ(s.score().total, 100);
  EXPECT_TRUE(s.score().failed_critical);
  EXPECT_TRUE(s.score().lines[2].failed);
  EXPECT_FALSE(s.score().passed);
  EXPECT_NE(summary(s.metrics, s.score()).find("CRITICAL"), std::string::npos);
}

TEST(Score, WhatWasNotMeasuredHasNoPoints) {
  Scored s;
  metric(s.metrics, "tumour_content").value.reset();
  EXPECT_DOUBLE_EQ(s.score().total, 75);
  metric(s.metrics, "forbidden_hits").value.reset();
  EXPECT_TRUE(s.score().failed_critical) << "nobody can say that it was not hit";
  s.scene.scoring.clear();
  EXPECT_FALSE(training::score(s.metrics, s.scene, true));
}

TEST(Score, OfNothingDoneIsNothing) {
  Scored s;
  s.scene.scoring = {{.metric = "punctures", .full = 3, .zero = 9},
                     {.metric = "out_of_plane_time", .full = 3, .zero = 12},
                     {.metric = "elapsed_time", .full = 60, .zero = 300},
                     {.metric = "forbidden_hits", .full = 0, .zero = 1, .critical = true}};
  s.scene.forbidden.resize(1);
  s.scene.exercise.plan = std::make_shared<procedures::biopsy::Plan>();
  Trace trace{.samples = {{.time_s = 0}, {.time_s = 20}},
              .events = {{.time_s = 1, .name = "stage", .fields = {{"stage", std::string("procedure")}}},
                         {.time_s = 19, .name = "stage", .fields = {{"stage", std::string("debrief")}}}}};
  const Score idle = *assess(trace, s.scene).score;
  EXPECT_EQ(idle.total, 0);
  EXPECT_FALSE(idle.done);
  EXPECT_FALSE(idle.passed);
  EXPECT_FALSE(idle.failed_critical) << "nothing was touched";
  s.scene.pass_mark = 0;
  EXPECT_FALSE(assess(trace, s.scene).score->passed) << "whatever the pass mark";
  EXPECT_NE(in_words(assess(trace, s.scene)).find("nothing was sampled"), std::string::npos);
  trace.events.insert(trace.events.begin() + 1, {.time_s = 5, .name = "biopsy_fired"});
  EXPECT_EQ(assess(trace, s.scene).score->total, 100) << "the same with a core";
}

TEST(Score, CoresThatWereNotTakenHoldNothing) {
  Scored s;
  auto plan = std::make_shared<procedures::biopsy::Plan>();
  plan->samples = 3;
  s.scene.exercise.plan = plan;
  const Trace one{.events = {{.name = "biopsy_fired"}, {.name = "core", .fields = {{"target_share", 0.9, "1"}}}}};
  EXPECT_NEAR(*find_metric(measure(one, s.scene), "tumour_content").value, 30, 1e-9);
}

TEST(Score, OfAThrowIsTheFarthestOfTheCoresThatHoldSomeOfTheTarget) {
  Scored s;
  const auto core = [](double share, double beyond) {
    return procedures::biopsy::to_event({.target_share = share, .content = {}, .end_beyond = beyond}, {});
  };
  const auto beyond = [&](std::vector<recording::EventRecord> events) {
    return find_metric(measure({.events = std::move(events)}, s.scene), "throw_beyond").value;
  };
  EXPECT_NEAR(*beyond({core(0.5, 0.004), core(0.9, -0.002), core(0, 0.09)}), 4, 1e-9);
  EXPECT_EQ(*beyond({core(0.5, -0.004)}), 0) << "it ended in the target";
  EXPECT_FALSE(beyond({core(0, -0.03)})) << "who fires far from the target has kept to no plan";
}

TEST(Score, CountsWhatATraceDoesNotTell) {
  Scored s;
  s.scene.scoring = {{.metric = "tumour_content", .full = 80, .zero = 20}};
  EXPECT_DOUBLE_EQ(assess({}, s.scene).score->total, 0);
  const Trace cores{.events = {tests::version_1_event(0, 0, "biopsy_fired", "1"),
                               tests::version_1_event(0, 0, "core", "target 70.00 %: tumour 70.00 %, liver 30.00 %"),
                               {.name = "core", .fields = {{"target_share", 0.3, "1"}}}}};
  EXPECT_DOUBLE_EQ(assess(cores, s.scene).score->total, 50);
}

TEST(Score, CountsTheLastTellingOfAnAblation) {
  Scored s;
  s.scene.scoring = {{.metric = "ablation_coverage", .full = 100, .zero = 0}};
  const Trace twice{
      .events = {{.name = "ablation_started"},
                 tests::version_1_event(0, 0, "ablated", "10 s, 0.31 ml; target 20.00 %, margin 10.00 %, least"),
                 tests::version_1_event(0, 0, "ablated", "20 s, 0.61 ml; target 50.00 %, margin 25.00 %, least")}};
  EXPECT_DOUBLE_EQ(assess(twice, s.scene).score->total, 25);
}

TEST(Score, WhatIsNoNumberInARecordingIsNoShare) {
  using procedures::biopsy::target_percent;
  for (const char* text : {"target nan %", "target inf %", "target 1e999 %", "target ", "target"}) {
    EXPECT_EQ(target_percent(tests::version_1_event(0, 0, "core", text)).value(), 0) << text;
  }
  EXPECT_FALSE(procedures::ablation::heated_s(tests::version_1_event(0, 0, "ablated", "inf s")));
  EXPECT_DOUBLE_EQ(target_percent(tests::version_1_event(0, 0, "core", "target 62.50 %: tumour 62.50 %")).value(),
                   62.5);
  const double nan = std::nan("");
  EXPECT_EQ(target_percent({.name = "core", .fields = {{"target_share", nan, "1"}}}).value(), 0);
  EXPECT_FALSE(procedures::ablation::heated_s({.name = "ablated", .fields = {{"heated", nan, "s"}}}));
}

TEST(Score, GoesIntoTheSessionsResults) {
  Scored s;
  metric(s.metrics, "tumour_content").value.reset();
  TrainingReport report{.trace = {}, .metrics = s.metrics, .score = s.score()};
  const auto json = with_training({{"format", "stylet-session"}}, report);
  EXPECT_EQ(json["format"], "stylet-session");
  EXPECT_EQ(json["metrics"].size(), s.metrics.size());
  EXPECT_EQ(json["metrics"][0]["key"], "targeting");
  EXPECT_EQ(json["metrics"][0]["value"], 2.0);
  EXPECT_EQ(json["metrics"][0]["unit"], "mm");
  EXPECT_EQ(json["score"]["total"], 75.0);
  EXPECT_TRUE(json["score"]["criteria"][1]["value"].is_null());
  EXPECT_EQ(json["score"]["criteria"][2]["critical"], true);
  EXPECT_FALSE(json.contains("samples_not_measured"));
  report.trace.dropped = 3;
  report.trace.samples.resize(1);
  report.trace.samples[0].time_s = 1800;
  report.score.reset();
  const auto short_of = with_training({}, report);
  EXPECT_EQ(short_of["samples_not_measured"], 3U);
  EXPECT_FALSE(short_of.contains("score"));
  EXPECT_NE(in_words(report).find("first 30 minutes"), std::string::npos);
}

}  // namespace
}  // namespace stylet::training
