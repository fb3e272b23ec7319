#include "engine/training/flow.h"
#include "engine/procedures/ablation/heating.h"
#include "engine/procedures/aspiration/plan.h"
#include "engine/procedures/biopsy/biopsy.h"
#include "engine/procedures/kinds.h"
#include "engine/readers/texts_file.h"
#include "tests/training/event_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::training {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr Action kFire = procedures::biopsy::kFire;
constexpr Action kHeat = procedures::ablation::kStart;
constexpr Action kStopHeating = procedures::ablation::kStop;

content::Exercise biopsy(int samples = 1, bool automatic = false) {
  auto plan = std::make_shared<procedures::biopsy::Plan>();
  plan->samples = samples;
  plan->automatic = automatic;
  return {.plan = plan};
}

content::Exercise ablation() {
  auto plan = std::make_shared<procedures::ablation::Plan>();
  plan->duration_s = 600;
  plan->time_factor = 60;
  return {.plan = plan};
}

content::Exercise aspiration() {
  return {.plan = std::make_shared<procedures::aspiration::Plan>()};
}

content::Scene scene_of(const content::Exercise& exercise) {
  content::Scene scene;
  scene.exercise = exercise;
  return scene;
}

/// A flow with the procedure of its exercise.
struct Course {
  explicit Course(const content::Exercise& exercise, std::size_t targets = 1, bool automatic = false)
      : scene(scene_of(exercise)),
        procedure(procedures::kind_of(exercise)->begin(scene)),
        flow(scene.exercise, targets, automatic, procedure.get()) {}
  Course(const Course&) = delete;
  const FlowState& state() const { return flow.state(); }

  content::Scene scene;
  std::unique_ptr<procedures::Procedure> procedure;
  Flow flow;
};

Situation outside(double t) {
  return {.time_s = t, .speed = 0.05, .target_distances = {0.05}};
}
Situation in_target(double t) {
  return {.time_s = t, .in_tissue = true, .depth = 0.08, .speed = 0.05, .target_distances = {-0.004}};
}

std::vector<std::string> step(Course& course, const Situation& now, std::vector<Action> actions = {}) {
  std::vector<std::string> out;
  for (const recording::EventRecord& event : course.flow.step(now, actions)) out.push_back(tests::event_words(event));
  return out;
}

/// Brings a course to a stage.
void enter(Course& course, Stage stage) {
  if (stage != Stage::briefing) step(course, outside(1), {Action::start});
  if (stage == Stage::sampling) step(course, in_target(2), {course.procedure->trigger()});
  if (stage == Stage::debrief) step(course, in_target(2), {Action::finish});
}

// The whole table: what each action does in each stage, tip in the target.
TEST(Flow, EveryActionInEveryStageOfABiopsyDoesWhatTheTableSays) {
  struct Row {
    Action action;
    std::array<const char*, 4> to;  // by stage: the stage afterwards; "-": refused
  };
  const std::array<Row, 8> table{{{Action::start, {"procedure", "-", "-", "-"}},
                                  {kFire, {"-", "sampling", "-", "-"}},
                                  {kHeat, {"-", "-", "-", "-"}},
                                  {kStopHeating, {"-", "-", "-", "-"}},
                                  {Action::pause, {"briefing", "procedure", "sampling", "-"}},
                                  {Action::resume, {"-", "-", "-", "-"}},
                                  {Action::reset, {"briefing", "procedure", "sampling", "debrief"}},
                                  {Action::finish, {"-", "debrief", "debrief", "-"}}}};
  const content::Exercise exercise = biopsy();
  for (const Row& row : table) {
    for (int s = 0; s < 4; ++s) {
      const auto stage = static_cast<Stage>(s);
      const std::string expected = row.to[s];
      Course flow(exercise);
      enter(flow, stage);
      const Situation now = row.action == Action::start ? outside(2.1) : in_target(2.1);
      const std::vector<std::string> events = step(flow, now, {row.action});
      const std::string place = std::string(row.action.name) + " in " + stage_name(stage);
      ASSERT_FALSE(events.empty()) << place;
      EXPECT_EQ(events[0].starts_with("refused"), expected == "-") << place << ": " << events[0];
      EXPECT_EQ(stage_name(flow.state().stage), expected == "-" ? stage_name(stage) : expected) << place;
      EXPECT_EQ(flow.flow.reset_asked_for(), row.action == Action::reset) << place;
      EXPECT_EQ(flow.state().refusal.empty(), expected != "-") << place;
    }
  }
}

TEST(Flow, SaysWhatCanBeDoneNow) {
  const content::Exercise exercise = biopsy();
  Course flow(exercise, 1, false);
  EXPECT_THAT(flow.state().possible, ElementsAre(Action::start, Action::pause, Action::reset));
  step(flow, outside(0), {Action::start});
  EXPECT_THAT(flow.state().possible, ElementsAre(Action::pause, Action::reset, Action::finish));
  step(flow, in_target(1));
  EXPECT_THAT(flow.state().possible, ElementsAre(Action::pause, Action::reset, Action::finish, kFire));
  step(flow, in_target(2), {Action::pause});
  EXPECT_THAT(flow.state().possible, ElementsAre(Action::resume, Action::reset, Action::finish));
}

TEST(Flow, GivesTheReasonForNotFiringOutsideTissue) {
  const content::Exercise exercise = biopsy();
  Course flow(exercise);
  enter(flow, Stage::procedure);
  EXPECT_THAT(
      step(flow, outside(2), {kFire}),
      ElementsAre("refused fire: the tip is outside the patient, 50 mm from the target: there is nothing to cut; "
                  "advance the needle"));
  EXPECT_THAT(flow.state().refusal, HasSubstr("outside the patient"));
  EXPECT_EQ(flow.procedure->samples(), 0);
  step(flow, outside(2 + Flow::kRefusalShown + 0.1));
  EXPECT_THAT(flow.state().refusal, IsEmpty()) << "shown for a while only";
}

/// Behind the wall, before the next organ.
Situation in_gap(double t) {
  return {.time_s = t, .in_tissue = false, .depth = 0.028, .speed = 0.05, .target_distances = {0.034}};
}
Situation in_wall(double t) {
  return {.time_s = t, .in_tissue = true, .depth = 0.02, .speed = 0.05, .target_distances = {0.042}};
}

TEST(Flow, SaysWhereTheTipIsThatCannotFireBetweenTwoOrgans) {
  const content::Exercise exercise = biopsy();
  Course flow(exercise);
  enter(flow, Stage::procedure);
  EXPECT_THAT(step(flow, in_gap(2), {kFire}),
              ElementsAre("refused fire: the tip is between two organs, 28 mm of needle in, 34 mm from the target: "
                          "there is nothing to cut; advance the needle"));
}

TEST(Flow, PromptNeverGoesBackAStage) {
  const content::Exercise exercise = biopsy();
  Course flow(exercise);
  enter(flow, Stage::procedure);
  const auto prompt = [&](const Situation& now) {
    step(flow, now);
    return flow.state().prompt;
  };
  EXPECT_THAT(prompt(outside(2)), HasSubstr("Find the target with the probe"));
  const std::string on_the_way = prompt(in_wall(3));
  EXPECT_EQ(prompt(in_gap(4)), on_the_way) << "between wall and liver";
  EXPECT_EQ(prompt(in_wall(5)), on_the_way);
  EXPECT_THAT(prompt(in_target(6)), HasSubstr("fire"));
  EXPECT_THAT(prompt(outside(7)), HasSubstr("out again")) << "it was found before";
}

TEST(Flow, HintsOfTheInsertedNeedleHoldBetweenWallAndLiver) {
  content::Exercise exercise = biopsy();
  exercise.hints = {{.text = "in", .tip_inside = true}, {.text = "out", .tip_inside = false}};
  Course flow(exercise);
  enter(flow, Stage::procedure);
  step(flow, in_gap(2));
  EXPECT_EQ(flow.state().hint, "in");
}

TEST(Flow, BeginsOnlyWithTheNeedleOut) {
  const content::Exercise exercise = biopsy();
  Course flow(exercise);
  EXPECT_THAT(step(flow, in_gap(1), {Action::start}), ElementsAre(HasSubstr("draw it out")));
  EXPECT_EQ(flow.state().stage, Stage::briefing);
  EXPECT_THAT(step(flow, outside(2), {Action::start}), ElementsAre("stage procedure"));
}

TEST(Flow, WordsFitTheDeviceAndTheNumberOfCores) {
  const auto said = [](int samples, const procedures::Controls& controls) {
    const content::Scene scene = scene_of(biopsy(samples));
    const auto procedure = procedures::kind_of(scene.exercise)->begin(scene);
    Flow flow(scene.exercise, 1, false, procedure.get(), controls);
    std::string words = flow.state().prompt + "|";
    constexpr std::array kStart{Action::start};
    flow.step(outside(0), kStart);
    for (int core = 0; core < samples; ++core) {
      flow.step(in_target(1 + 2 * core), {});
      words += flow.state().prompt + "|";
      flow.step(in_target(1.1 + 2 * core), std::array{kFire});
      words += flow.state().prompt + "|";
    }
    return words;
  };
  EXPECT_EQ(said(1, {.begin = "Enter", .act = "T", .finish = "Enter"}),
            "Read the briefing; Enter begins.|The tip is in the target: hold still and fire (T).|"
            "The core is taken: withdraw the needle and finish (Enter).|");
  EXPECT_EQ(said(2, {.begin = "button 1", .act = "button 1"}),
            "Read the briefing; button 1 begins.|"
            "The tip is in the target: hold still and fire for core 1 of 2 (button 1).|"
            "Core 1 of 2 is taken: the gun is being cocked.|"
            "The tip is in the target: hold still and fire for core 2 of 2 (button 1).|"
            "All 2 cores are taken: withdraw the needle and finish.|");
  EXPECT_THAT(said(1, {}), HasSubstr("start when you are ready"));
}

TEST(Flow, WhatItSaysToATraineeAtTheWindowIsInTheGermanCatalogue) {
  const content::Texts german = readers::find_texts("de");
  const auto expect = [&](const std::string& english) {
    if (!english.empty()) {
      EXPECT_NE(german.of(english), english);
    }
  };
  const std::array<procedures::Controls, 3> kinds_of_controls{
      {{},
       {.begin = "Enter", .act = "T", .finish = "Enter"},
       {.begin = "button 1 or Enter", .act = "button 1 or T", .finish = "Enter"}}};
  for (const content::Exercise& exercise :
       {biopsy(1), biopsy(3), biopsy(1, true), biopsy(3, true), ablation(), aspiration()}) {
    for (const procedures::Controls& controls : kinds_of_controls) {
      const content::Scene scene = scene_of(exercise);
      const auto procedure = procedures::kind_of(scene.exercise)->begin(scene);
      Flow flow(scene.exercise, 1, false, procedure.get(), controls);
      const auto at = [&](const Situation& now, std::vector<Action> actions = {}) {
        flow.step(now, actions);
        expect(flow.state().prompt);
        expect(flow.state().refusal);
      };
      expect(flow.state().prompt);
      at(in_gap(0), {Action::start});
      at(outside(1), {procedure->trigger()});
      at(outside(2), {Action::start});
      at(outside(3), {Action::start});
      at(outside(4), {procedure->trigger()});
      at(in_wall(5));
      at(in_gap(6), {procedure->trigger()});
      at(outside(7));
      for (int act = 0; act < 4; ++act) {
        at(in_target(8 + 3 * act));
        at(in_target(9 + 3 * act), {procedure->trigger()});
        at(in_target(10 + 3 * act));
      }
      at(in_target(30), {Action::pause});
      at(in_target(31), {Action::resume});
      at(in_target(32), {Action::finish});
    }
  }
}

TEST(Flow, AutomaticCoresAreNotAskedFor) {
  const content::Exercise exercise = biopsy(2, true);
  Course flow(exercise, 2);
  step(flow, outside(0), {Action::start});
  Situation at = in_target(1);
  at.target_distances = {-0.004, 0.03};
  step(flow, at);
  EXPECT_THAT(flow.state().prompt, HasSubstr("by itself"));
  at.speed = 0;
  at.time_s = 1.1;
  step(flow, at);
  at.time_s = 1.5;
  EXPECT_THAT(step(flow, at), ElementsAre("biopsy_fired 1", "stage sampling"));
  at.time_s = 3;
  step(flow, at);
  EXPECT_THAT(flow.state().prompt, HasSubstr("has its core"));
}

TEST(Flow, GunIsCockedBetweenTwoCores) {
  const content::Exercise exercise = biopsy(2);
  Course flow(exercise);
  enter(flow, Stage::procedure);
  EXPECT_THAT(step(flow, in_target(2), {kFire}), ElementsAre("biopsy_fired 1", "stage sampling"));
  EXPECT_THAT(step(flow, in_target(2.5), {kFire}), ElementsAre("refused fire: the gun is being cocked"));
  EXPECT_THAT(step(flow, in_target(3.1)), ElementsAre("stage procedure"));
  EXPECT_THAT(step(flow, in_target(3.2), {kFire}), ElementsAre("biopsy_fired 2", "stage sampling"));
  EXPECT_THAT(step(flow, in_target(9), {kFire}), ElementsAre("refused fire: all 2 cores are taken; finish"));
  EXPECT_THAT(step(flow, in_target(9.1), {Action::finish}), ElementsAre("stage debrief"));
}

TEST(Flow, ButtonStartsThenFiresOnceAPress) {
  const content::Exercise exercise = biopsy(2);
  Course flow(exercise, 1, false);
  const auto pressed = [](double t, std::uint32_t presses) {
    Situation input = in_target(t);
    input.presses = presses;
    return input;
  };
  Situation first = outside(0);
  first.presses = 1;
  EXPECT_THAT(step(flow, first), ElementsAre("stage procedure"));
  EXPECT_THAT(step(flow, pressed(1, 1)), IsEmpty()) << "still the same press";
  EXPECT_THAT(step(flow, pressed(3, 2)), ElementsAre("biopsy_fired 1", "stage sampling"));
}

TEST(Flow, AutomaticSessionStartsAndFiresWhereTheTipRestsInEachTargetOnce) {
  const content::Exercise exercise = biopsy(2, true);
  Course flow(exercise, 2, true);
  const auto at = [](double t, double speed, double first, double second) {
    return Situation{
        .time_s = t, .in_tissue = true, .depth = 0.05, .speed = speed, .target_distances = {first, second}};
  };
  EXPECT_THAT(step(flow, at(0, 0.04, 0.02, 0.03)), ElementsAre("stage procedure"));
  EXPECT_THAT(step(flow, at(1.0, 0.04, -0.003, 0.03)), IsEmpty()) << "it moves";
  EXPECT_THAT(step(flow, at(1.2, 0.001, -0.003, 0.03)), IsEmpty()) << "it has not rested long enough";
  EXPECT_THAT(step(flow, at(1.3, 0.001, -0.003, 0.03)), ElementsAre("biopsy_fired 1", "stage sampling"));
  EXPECT_THAT(step(flow, at(2.4, 0.001, -0.003, 0.03)), ElementsAre("stage procedure")) << "this target has its core";
  EXPECT_THAT(step(flow, at(3.0, 0.001, 0.03, 0.001)), IsEmpty()) << "just outside the other";
  EXPECT_THAT(step(flow, at(3.4, 0.001, 0.03, -0.001)), ElementsAre("biopsy_fired 2", "stage sampling"));
  EXPECT_EQ(flow.flow.treated(), (std::vector<bool>{true, true}));
}

TEST(Flow, AblationHeatsByItsOwnClockAndStopsWhenItsTimeIsOver) {
  const content::Exercise exercise = ablation();
  Course flow(exercise);
  enter(flow, Stage::procedure);
  Situation shallow = in_target(2);
  shallow.depth = 0.02;
  EXPECT_THAT(step(flow, shallow, {kHeat}), ElementsAre(HasSubstr("30 mm of bare tip 20 are in")));
  EXPECT_THAT(step(flow, in_target(3), {kHeat}), ElementsAre("ablation_started", "stage sampling"));
  EXPECT_THAT(step(flow, in_target(8)), IsEmpty());
  EXPECT_DOUBLE_EQ(dynamic_cast<const procedures::ablation::Heating&>(*flow.procedure).heated_s(), 300);
  EXPECT_THAT(step(flow, in_target(9), {kStopHeating}), ElementsAre("ablation_stopped 360 s"));
  EXPECT_THAT(step(flow, in_target(10), {kHeat}), ElementsAre("ablation_started"));
  EXPECT_THAT(step(flow, in_target(14.5)), ElementsAre("ablation_stopped 630 s")) << "600 s are over";
  EXPECT_THAT(step(flow, in_target(15), {kHeat}), ElementsAre(HasSubstr("is over; finish")));
}

TEST(Flow, FinishStopsTheHeating) {
  const content::Exercise exercise = ablation();
  Course flow(exercise);
  enter(flow, Stage::sampling);
  EXPECT_THAT(step(flow, in_target(3), {Action::finish}), ElementsAre("ablation_stopped 60 s", "stage debrief"));
}

TEST(Flow, PausedNothingIsFired) {
  const content::Exercise exercise = biopsy(1, true);
  Course flow(exercise);
  enter(flow, Stage::procedure);
  EXPECT_THAT(step(flow, in_target(2), {Action::pause}), ElementsAre("paused"));
  Situation rest = in_target(2);
  rest.speed = 0;
  rest.presses = 1;
  EXPECT_THAT(step(flow, rest), IsEmpty());
  EXPECT_THAT(step(flow, rest, {kFire}), ElementsAre("refused fire: the session is paused; resume first"));
  EXPECT_THAT(step(flow, rest, {Action::resume}), ElementsAre("resumed")) << "the press was in the pause";
}

TEST(Flow, HintIsTheFirstWhoseConditionsAllHold) {
  content::Exercise exercise = biopsy();
  exercise.hints = {{.text = "lifted", .probe_lifted = true},
                    {.text = "off plane", .stage = "procedure", .tip_inside = true, .off_plane = {0.003, 1}},
                    {.text = "near", .stage = "procedure", .distance = {-1, 0.02}},
                    {.text = "slow", .stage = "procedure", .stage_s = {10, 100}},
                    {.text = "hard", .force = {3, 100}},
                    {.text = "deep", .depth = {0.1, 1}},
                    {.text = "done", .samples = {1, 9}}};
  Course flow(exercise, 1, false);
  const auto hint = [&](Situation input) {
    flow.flow.step(input, {});
    return flow.state().hint;
  };
  EXPECT_EQ(hint(outside(0)), "");
  step(flow, outside(0), {Action::start});
  EXPECT_EQ(hint(outside(1)), "");
  EXPECT_EQ(hint(outside(11)), "slow");
  Situation input = in_target(12);
  EXPECT_EQ(hint(input), "near");
  input.off_plane = 0.004;
  EXPECT_EQ(hint(input), "off plane");
  input.in_tissue = false;
  const double depth = std::exchange(input.depth, 0);
  EXPECT_EQ(hint(input), "near");
  input.depth = depth;
  input.probe_lifted = true;
  EXPECT_EQ(hint(input), "lifted");
  input = outside(5);
  input.force = 4;
  EXPECT_EQ(hint(input), "hard");
  input.force = 0;
  input.depth = 0.12;
  EXPECT_EQ(hint(input), "deep");
  step(flow, in_target(6), {kFire});
  EXPECT_EQ(hint(outside(6.1)), "done");
}

}  // namespace
}  // namespace stylet::training
