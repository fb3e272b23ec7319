// Points: linear between the thresholds, weighted, with a pass mark and critical failures.
#include "engine/training/score.h"
#include "engine/training/results.h"
#include "engine/training/training_report.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>
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
  Score score() const { return *training::score(metrics, scene); }
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
  EXPECT_FALSE(training::score(s.metrics, s.scene));
}

TEST(Score, CountsWhatATraceDoesNotTell) {
  Scored s;
  s.scene.scoring = {{.metric = "tumour_content", .full = 80, .zero = 20}};
  EXPECT_DOUBLE_EQ(assess({}, s.scene).score->total, 0);
  const Trace cores{.events = {{.name = "core", .detail = "target 70.00 %: tumour 70.00 %, liver 30.00 %"},
                               {.name = "core", .detail = "target 30.00 %: liver 70.00 %, tumour 30.00 %"}}};
  EXPECT_DOUBLE_EQ(assess(cores, s.scene).score->total, 50);
}

TEST(Score, CountsTheLastTellingOfAnAblation) {
  Scored s;
  s.scene.scoring = {{.metric = "ablation_coverage", .full = 100, .zero = 0}};
  const Trace twice{
      .events = {{.name = "ablated", .detail = "10 s, 0.31 ml; target 20.00 %, margin 10.00 %, least"},
                 {.name = "ablated", .detail = "20 s, 0.61 ml; target 50.00 %, margin 25.00 %, least"}}};
  EXPECT_DOUBLE_EQ(assess(twice, s.scene).score->total, 25);
}

TEST(Score, WhatIsNoNumberInARecordingIsNoShare) {
  for (const char* detail : {"target nan %", "target inf %", "target 1e999 %", "target ", "target", ""})
    EXPECT_FALSE(percent_in(detail, "target")) << detail;
  EXPECT_FALSE(heated_in("inf s"));
  EXPECT_DOUBLE_EQ(percent_in("target 62.50 %: tumour 62.50 %", "target").value(), 62.5);
}

TEST(Score, GoesIntoTheSessionsResults) {
  Scored s;
  metric(s.metrics, "tumour_content").value.reset();
  TrainingReport report{.trace = {}, .metrics = s.metrics, .score = s.score()};
  const auto json = with_training({{"format", "stylet-session"}}, report);
  EXPECT_EQ(json["format"], "stylet-session");
  EXPECT_EQ(json["metrics"].size(), content::metric_table().size());
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
