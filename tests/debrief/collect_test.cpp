// From a session to its debrief: what is kept of it, and whom it is compared with.
#include "engine/debrief/collect.h"
#include "engine/debrief/session_replay.h"

#include "engine/debrief/expert.h"
#include "engine/files/error.h"
#include "engine/procedures/biopsy/plan.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "tests/session/cube_scene.h"
#include "tests/session/layered_scene.h"
#include "tests/support/temporary_folder.h"

#include "tests/training/event_words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

namespace stylet::debrief {
namespace {

namespace fs = std::filesystem;

content::Scene short_scene(double duration_s) {
  content::Scene scene = tests::cube_scene(3);
  std::erase_if(scene.motion.stylus, [&](const content::MotionSample& s) { return s.time_s > duration_s; });
  return scene;
}

recording::Recording recorded(const content::Scene& scene, const fs::path& path) {
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  session::LiveSession live(scene, device,
                            {.duration_s = scene.motion.stylus.back().time_s, .lockstep = true, .recording = path});
  live.run_in_lockstep();
  return recording::read_recording(path);
}

TEST(Debrief, KeepsOfEachSpellTheMomentOfTheGreatestForce) {
  training::Trace trace;
  for (int i = 0; i < 10'000; ++i) {
    training::TraceSample& sample = trace.samples.emplace_back();
    sample.time_s = 0.02 * i;
    sample.force.z() = i == 4321 ? -7 : -0.5;
  }
  const std::vector<PathPoint> path = path_of(trace);
  EXPECT_LE(path.size(), 3000u);
  EXPECT_GE(path.size(), 1000u);
  const auto peak = std::ranges::max_element(path, {}, &PathPoint::force);
  EXPECT_EQ(peak->time_s, 0.02 * 4321);
  EXPECT_EQ(peak->axial, 7) << "along the needle, against insertion";
  EXPECT_TRUE(std::ranges::is_sorted(path, {}, &PathPoint::time_s));
}

TEST(Debrief, SaysEventsInWords) {
  const std::vector<DebriefEvent> events = events_of(
      {tests::version_1_event(3, 3000, "safety", "max_force"),
       tests::version_1_event(1, 1000, "puncture", "fat > muscle, 0.8000 N (0.00123 J)"),
       tests::version_1_event(0.5, 500, "stage", "procedure"), tests::version_1_event(0.9, 900, "entered", ""),
       tests::version_1_event(2, 2000, "buttons", ""), tests::version_1_event(2.5, 2500, "biopsy_fired", "1"),
       tests::version_1_event(4, 4000, "new_kind_of_thing", "with a detail")});
  ASSERT_EQ(events.size(), 5u);
  EXPECT_EQ(events[0].title, "Procedure");
  EXPECT_EQ(events[0].kind, EventKind::stage);
  EXPECT_EQ(events[1].title, "Into muscle");
  EXPECT_EQ(events[1].detail, "from fat, 0.80 N");
  EXPECT_EQ(events[2].title, "Biopsy fired");
  EXPECT_EQ(events[2].kind, EventKind::sample);
  EXPECT_EQ(events[3].kind, EventKind::safety);
  EXPECT_EQ(events[4].title, "New kind of thing");
}

TEST(Debrief, AnAblationIsNoSampling) {
  const std::vector<DebriefEvent> events =
      events_of({tests::version_1_event(0, 0, "stage", "procedure"),
                 tests::version_1_event(2, 2000, "puncture", "agar > dark_target, 0.4 N (0.00123 J)"),
                 tests::version_1_event(5, 5000, "ablation_started", ""),
                 tests::version_1_event(5, 5000, "stage", "sampling")});
  ASSERT_EQ(events.size(), 4u);
  EXPECT_EQ(events[1].title, "Into dark target");
  EXPECT_EQ(events[3].title, "Ablation");
  EXPECT_EQ(events_of({tests::version_1_event(1, 1000, "biopsy_fired", "2"),
                       tests::version_1_event(1, 1000, "stage", "sampling")})[1]
                .title,
            "Sampling");
}

TEST(Debrief, OfASessionHasItsWayItsMomentsAndItsNumbers) {
  const content::Scene scene = short_scene(0.6);
  const support::TemporaryFolder folder;
  const recording::Recording recording = recorded(scene, folder / "session.rec");
  SessionReplay replay(scene, recording);
  replay.run();
  const Expert expert{
      .name = "expert",
      .metrics = {{.key = "path_length", .title = {}, .unit = {}, .value = 1, .definition = {}, .source = {}}}};
  const DebriefData data = collect(scene, recording, replay, training::measure(replay.trace(), scene), expert);
  ASSERT_EQ(data.path.size(), replay.trace().samples.size());
  const auto deepest = std::ranges::max_element(data.path, {}, &PathPoint::inserted);
  EXPECT_NEAR(deepest->inserted, replay.force().summary().max_depth, 0.002);
  EXPECT_NEAR(data.arrival_s, deepest->time_s, 0.1) << "straight down to the target";
  EXPECT_LT((data.shaft.back() - data.targets.front().centre).norm(), 0.02);
  ASSERT_EQ(data.events.size(), 1u);
  EXPECT_EQ(data.events.front().title, "Into gel");
  const auto length = std::ranges::find(data.metrics, "path_length", &DebriefMetric::key);
  ASSERT_NE(length, data.metrics.end());
  EXPECT_EQ(length->expert, 1);
  EXPECT_GT(length->value.value_or(0), 10);
  EXPECT_FALSE(data.cut_off);
  const std::vector<KeyMoment> moments = key_moments(scene, recording, replay.trace());
  ASSERT_EQ(moments.size(), 2u);
  EXPECT_EQ(moments.front().title, "Into gel");
  EXPECT_EQ(moments.front().time_s, data.events.front().time_s);
  EXPECT_EQ(moments.back().time_s, data.arrival_s);
}

TEST(Expert, HasEveryMetricThatIsScored) {
  content::Scene scene = tests::layered_scene();
  auto plan = std::make_shared<procedures::biopsy::Plan>();
  plan->automatic = true;
  scene.exercise.plan = plan;
  const Expert expert = run_expert_motion(scene);
  for (const char* key : {"tumour_content", "throw_beyond", "targeting", "elapsed_time"}) {
    EXPECT_TRUE(training::find_metric(expert.metrics, key).value) << key;
  }
  EXPECT_GT(training::find_metric(expert.metrics, "tumour_content").value.value_or(0), 30);
}

TEST(Expert, IsRunOnceAndRememberedUntilTheSceneChanges) {
  content::Scene scene = short_scene(0.3);
  const support::TemporaryFolder folder;
  const fs::path cache = folder / "cache";
  const Expert first = expert_motion(scene, "build", cache);
  ASSERT_GT(first.path.size(), 10u);
  const auto files = [&] { return std::distance(fs::directory_iterator(cache), fs::directory_iterator{}); };
  ASSERT_EQ(files(), 1);
  int runs = 0;
  const auto count = [&](double) { ++runs; };
  const Expert again = expert_motion(scene, "build", cache, count);
  EXPECT_EQ(runs, 0);
  ASSERT_EQ(again.path.size(), first.path.size());
  EXPECT_EQ(again.path.back().tip, first.path.back().tip) << "to the bit";
  EXPECT_EQ(training::find_metric(first.metrics, "path_length").value,
            std::ranges::find(again.metrics, "path_length", &training::Metric::key)->value);

  // Torn by a crash: made again.
  fs::resize_file(fs::directory_iterator(cache)->path(), 100);
  EXPECT_EQ(expert_motion(scene, "build", cache, count).path.size(), first.path.size());
  EXPECT_GT(runs, 0);
  // Softer tissue, another build: another expert.
  scene.tissues[1].mechanics.young_modulus /= 2;
  expert_motion(scene, "build", cache);
  expert_motion(scene, "another build", cache);
  EXPECT_EQ(files(), 3);
  // Nowhere to remember.
  EXPECT_EQ(expert_motion(scene, "build", "/proc/none").path.size(), first.path.size());
}

TEST(Expert, OfARecordingIsOfTheSameScenario) {
  content::Scene scene = short_scene(0.3);
  const support::TemporaryFolder folder;
  recorded(scene, folder / "teacher.rec");
  const Expert expert = expert_recording(scene, folder / "teacher.rec");
  EXPECT_EQ(expert.name, "expert: teacher.rec");
  EXPECT_GT(expert.path.size(), 10u);
  scene.scenario = "another";
  EXPECT_THROW(expert_recording(scene, folder / "teacher.rec"), files::ContentError);
}

}  // namespace
}  // namespace stylet::debrief
