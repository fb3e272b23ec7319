// What a session leaves in the lab's records, and where that puts a trainee in a course.
#include "engine/app/kept_in_lab.h"

#include "engine/app/build_name.h"
#include "engine/app/course_standing.h"
#include "engine/app/lab_pages.h"
#include "engine/app/take_recording.h"
#include "engine/app/trainee_door.h"
#include "engine/files/error.h"
#include "engine/lab/course/course_file.h"
#include "engine/lab/server/logins.h"
#include "engine/lab/store/digest.h"
#include "engine/lab/store/lab.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/training/training_session.h"
#include "tests/readers/small_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace stylet::app {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class LabListener final : public SessionObserver {
public:
  void progress(const std::string& task, double /*share*/) override {
    if (task.starts_with("Session in ") && during) during();
  }
  void note(Note /*kind*/, const std::string& text) override { notes.push_back(text); }
  std::function<void()> during{};
  std::vector<std::string> notes{};
};

class KeptInLab : public ::testing::Test {
protected:
  KeptInLab() {
    files_.scenario["labels"]["spacing_mm"] = 4;
    files_.write();
  }
  fs::path folder() const { return files_.folder / "lab"; }
  SessionSettings settings() const {
    return {.scenario = files_.path().string(),
            .view = SessionView::headless,
            .lockstep = true,
            .seconds = 0.5,
            .expert = "none",
            .film = false,
            .out = files_.folder / "out",
            .trainee = {.name = "ada", .lab = folder()}};
  }
  lab::store::Lab lab() const { return lab::store::Lab({.folder = folder(), .build = "test"}); }

  /// An attempt of a hand.
  void take(TraineeRecords& records, const content::Scene& scene, bool passed, bool to_its_end = true,
            const LabAttempt::Facts& facts = {.stylus = "mouse", .by_hand = true, .loop_mode = "threaded"}) {
    LabAttempt attempt(records, scene, facts);
    attempt.begin();
    training::TrainingReport training;
    training.metrics.push_back({.key = "elapsed_time", .unit = "s", .value = 60});
    training.score = training::Score{.total = passed ? 80.0 : 40.0, .pass_mark = 70, .done = true, .passed = passed};
    EXPECT_THAT(attempt.end({}, training, to_its_end, {}), IsEmpty());
  }

  readers::test::SmallScenario files_;
};

TEST_F(KeptInLab, ADemonstrationIsKeptWithItsNumbersAndRecordingAndCountsForNothing) {
  LabListener listener;
  const SessionResult result = run_session(settings(), listener);
  EXPECT_THAT(result.not_kept_because, IsEmpty());
  EXPECT_THAT(listener.notes, testing::Contains(HasSubstr("ada is new in")));
  lab::store::Lab records = lab();
  const auto attempts = records.attempts();
  ASSERT_THAT(attempts, SizeIs(1));
  EXPECT_EQ(attempts[0].mode, "guided");
  EXPECT_EQ(attempts[0].status, "ended");
  EXPECT_FALSE(attempts[0].counts());
  EXPECT_EQ(attempts[0].scenario, files_.path().stem());
  EXPECT_EQ(attempts[0].recording_sha256, lab::store::sha256_of_file(result.folder / "session.rec"));
  EXPECT_EQ(records.metrics(attempts[0].id).size(), result.training.metrics.size());
}

TEST_F(KeptInLab, WithoutANameNothingIsKeptAnywhere) {
  SessionSettings nobody = settings();
  nobody.trainee.name.clear();
  LabListener listener;
  run_session(nobody, listener);
  EXPECT_FALSE(fs::exists(folder()));
}

TEST_F(KeptInLab, TheAttemptIsKeptAlsoWhereItsResultsCannotBeWritten) {
  // A folder takes the place of a result while the session runs.
  LabListener listener;
  const fs::path place = files_.folder / "out" / "session.json" / "in the way";
  listener.during = [&] { fs::create_directories(place); };
  EXPECT_THROW(run_session(settings(), listener), files::ContentError);
  lab::store::Lab records = lab();
  ASSERT_THAT(records.attempts(), SizeIs(1));
  EXPECT_EQ(records.attempts()[0].status, "ended");
  EXPECT_THAT(records.metrics(records.attempts()[0].id), testing::Not(IsEmpty()));
  EXPECT_TRUE(fs::exists(records.recording_of(records.attempts()[0].id)));
}

TEST_F(KeptInLab, TheSessionIsKeptAlsoWhereTheRecordsCannotBeWritten) {
  LabListener listener;
  const fs::path recordings = folder() / "recordings";
  listener.during = [&] {
    if (!fs::exists(recordings)) std::ofstream(recordings) << "in the way";
  };
  const SessionResult result = run_session(settings(), listener);
  EXPECT_THAT(result.not_kept_because, HasSubstr("without its recording"));
  lab::store::Lab records = lab();
  ASSERT_THAT(records.attempts(), SizeIs(1));
  EXPECT_EQ(records.attempts()[0].status, "ended") << "but for its recording it is there";
  EXPECT_THAT(records.attempts()[0].recording_sha256, IsEmpty());
  EXPECT_THAT(records.metrics(records.attempts()[0].id), testing::Not(IsEmpty()));
  EXPECT_TRUE(result.page_written);
  EXPECT_TRUE(fs::exists(result.folder / "session.rec"));
}

TEST_F(KeptInLab, ABeginningThatFailedIsTriedAgainAtTheEnd) {
  LabListener listener;
  const fs::path in_the_way = folder() / "running";
  fs::create_directories(folder());
  std::ofstream(in_the_way).put('x');
  const auto records = open_records({.name = "ada", .lab = folder()}, files_.path().string(), listener);
  const content::Scene scene = readers::load_scene(files_.path());
  LabAttempt attempt(*records, scene, {.stylus = "mouse", .by_hand = true, .loop_mode = "threaded"});
  attempt.begin();
  EXPECT_THAT(attempt.end({}, {}, true, {}), HasSubstr("is not in the lab's records")) << "it cannot be";
  EXPECT_THAT(records->lab.attempts(), IsEmpty());
  // In the way until the end.
  LabAttempt other(*records, scene, {.stylus = "mouse", .by_hand = true, .loop_mode = "threaded"});
  other.begin();
  other.wait();
  fs::remove(in_the_way);
  EXPECT_THAT(other.end({}, {}, true, {}), IsEmpty());
  ASSERT_THAT(records->lab.attempts(), SizeIs(1));
  EXPECT_EQ(records->lab.attempts()[0].status, "ended");
}

TEST_F(KeptInLab, WhatIsWrongIsRefusedBeforeThePatientIsLoaded) {
  const auto refusal = [&](SessionSettings wrong) -> std::string {
    LabListener listener;
    wrong.scenario = "tutorial";
    try {
      run_session(wrong, listener);
    } catch (const files::ContentError& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  SessionSettings wrong = settings();
  wrong.trainee.course = "needle_basic";
  EXPECT_THAT(refusal(wrong), HasSubstr("did you mean needle_basics?"));
  wrong.trainee.course = (files_.folder / "course.json").string();
  std::ofstream(wrong.trainee.course) << R"({"format": "stylet-course", "version": 1, "name": "other", "exercises": [
    {"name": "it", "scenario": ")" << files_.path().string()
                                      << R"(", "gate": {"acceptable_failure_rate": 0.1,
     "unacceptable_failure_rate": 0.3, "source": "a test"}}]})";
  EXPECT_THAT(refusal(wrong), HasSubstr("the course other has no exercise of"));
  wrong.trainee = {.name = " ", .lab = folder()};
  EXPECT_THAT(refusal(wrong), HasSubstr("is no name"));
}

TEST_F(KeptInLab, AnImportedSessionThatWasBrokenOffIsNoneThatEnded) {
  lab::store::Lab records = lab();
  const lab::store::Person ada = records.enrolled("ada");
  LabListener listener;
  const content::Scene scene = readers::load_scene(files_.path());
  for (const bool broken_off : {false, true}) {
    const fs::path recording = files_.folder / (broken_off ? "broken.rec" : "whole.rec");
    haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
    training::TrainingSession course(scene, {.automatic = true});
    session::LiveSession live(scene, device,
                              {.duration_s = 0.2,
                               .lockstep = true,
                               .recording = recording,
                               .build = build_name(),
                               .listeners = {&course.watch()}});
    live.run_in_lockstep([&](double share) {
      if (share < 1) {
        course.poll(live);
      } else {
        if (broken_off) mark_broken_off(live, course);
        course.end(live);
      }
    });
    const TakenRecording taken = take_recording(records, ada, {.recording = recording.string()}, listener);
    EXPECT_EQ(taken.broken_off, broken_off);
    EXPECT_EQ(records.attempts().back().id, taken.attempt);
    EXPECT_EQ(records.attempts().back().status, broken_off ? "aborted" : "ended");
  }
}

TEST_F(KeptInLab, TheDoorAsksOnlyWhereTheLabHasNamesAndOpensByThePinAlone) {
  EXPECT_EQ(TraineeDoor::at(folder()), nullptr);
  EXPECT_FALSE(fs::exists(folder())) << "asking makes no records";
  std::string bob, ada;
  {
    lab::store::Lab records = lab();
    EXPECT_EQ(TraineeDoor::at(folder()), nullptr) << "nobody is in them";
    ada = records.enrolled("ada").pseudonym;
    bob = records.enrolled("bob").pseudonym;
    records.set_pin(records.get("bob").id, lab::server::password_hash("2468"));
  }
  const auto door = TraineeDoor::at(folder());
  ASSERT_NE(door, nullptr);
  EXPECT_TRUE(door->try_pin(ada, "").right) << "has none";
  const panels::PinAnswer wrong = door->try_pin(bob, "2469");
  EXPECT_FALSE(wrong.right);
  EXPECT_TRUE(wrong.looked_at);
  EXPECT_GE(wrong.wait_s, 1);
  const panels::PinAnswer early = TraineeDoor::at(folder())->try_pin(bob, "2468");
  EXPECT_TRUE(early.right || !early.looked_at) << "held up, unless that second is over";
  lab().pin_tried(lab().get("bob").id, true);
  EXPECT_TRUE(door->try_pin(bob, "2468").right);
  panels::TraineeChoice choice = door->choice();
  choice.choose(bob);
  EXPECT_EQ(choice.pseudonym(), bob);
  for (const char* none : {"", "123", "1234567890123", "12a4", "12 4"}) EXPECT_FALSE(is_pin(none)) << none;
  EXPECT_TRUE(is_pin("0000"));
}

TEST_F(KeptInLab, AttemptsOfAHandPutATraineeSomewhereInACourse) {
  const content::Scene scene = readers::load_scene(files_.path());
  LabListener listener;
  const auto records = open_records({.name = "ada", .lab = folder()}, files_.path().string(), listener);
  ASSERT_NE(records, nullptr);
  lab::course::Course course{.name = "small"};
  lab::course::Exercise exercise{.name = "it", .scenario = files_.path(), .practice = 1, .days = 1};
  exercise.gate = lab::statistics::learning_gate({}, 30, 0.05);
  course.exercises = {exercise};
  const auto standing = [&] {
    return standing_of(records->lab, records->person, course, local_day(lab::store::system_ms())).exercises[0];
  };
  take(*records, scene, false);
  EXPECT_EQ(standing().standing, lab::course::Standing::practising);
  for (int i = 0; i < 14; ++i) take(*records, scene, true);
  EXPECT_EQ(standing().standing, lab::course::Standing::graded) << "14 passes are 3.518";
  take(*records, scene, true, false);  // passed so far, and left: a failure
  EXPECT_EQ(standing().standing, lab::course::Standing::graded);
  EXPECT_NEAR(standing().chart.back().sum, 14 * 0.251314 - 1.098612, 1e-4);
  for (int i = 0; i < 5; ++i) take(*records, scene, true);
  EXPECT_EQ(standing().standing, lab::course::Standing::competent);
  // Time that waits for the pictures is practice; another device has a chart of its own.
  take(*records, scene, false, true, {.stylus = "mouse", .by_hand = true, .loop_mode = "lockstep"});
  EXPECT_EQ(records->lab.attempts().back().mode, "practice");
  EXPECT_EQ(standing().standing, lab::course::Standing::competent);
  take(*records, scene, true, true, {.stylus = "pen", .by_hand = true, .loop_mode = "threaded"});
  EXPECT_EQ(standing().standing, lab::course::Standing::practising);
  records->lab.exclude(records->lab.attempts().back().id, "trainer", "another device");
  EXPECT_EQ(standing().standing, lab::course::Standing::competent);
  // A bar that nobody met makes failures of them all.
  course.exercises[0].bars = {{.metric = "elapsed_time", .at_most = 59}};
  EXPECT_EQ(standing().chart.back().sum, 0);
  course.exercises[0].bars = {{.metric = "elapsed_time", .at_most = 60}};
  EXPECT_EQ(standing().standing, lab::course::Standing::competent);
  // The scenario becomes another one: its attempts are on a chart of their own.
  files_.scenario["pass_mark"] = 90;
  files_.write();
  EXPECT_EQ(standing().standing, lab::course::Standing::practising);
  EXPECT_EQ(standing_of(records->lab, records->person, course, 0).at_earlier_versions[0], 21);
}

TEST_F(KeptInLab, TheCohortStandsWhereEachOfItsPeopleStands) {
  const content::Scene scene = readers::load_scene(files_.path());
  LabListener listener;
  lab::course::Course course{.name = "small"};
  lab::course::Exercise exercise{.name = "it", .scenario = files_.path(), .practice = 1, .days = 1};
  exercise.gate = lab::statistics::learning_gate({}, 30, 0.05);
  exercise.bars = {{.metric = "elapsed_time", .at_most = 60}};
  course.exercises = {exercise};
  for (const std::string name : {"ada", "bob", "eve"}) {
    const auto records = open_records({.name = name, .lab = folder()}, files_.path().string(), listener);
    ASSERT_NE(records, nullptr);
    for (int i = 0; i < (name == "eve" ? 0 : 3); ++i) take(*records, scene, name == "bob" || i == 2);
  }
  lab::store::Lab records = lab();
  const auto views = cohort_views(records, course, true, lab::store::system_ms());
  ASSERT_THAT(views, SizeIs(3));
  for (const auto& view : views) {
    const auto alone = lab_view(records, course, view.person, true, lab::store::system_ms());
    SCOPED_TRACE(view.person.name);
    EXPECT_EQ(view.passed, alone.passed);
    EXPECT_EQ(view.due, alone.due);
    EXPECT_EQ(view.attempts.size(), alone.attempts.size());
    EXPECT_EQ(view.exercises[0].standing, alone.exercises[0].standing);
    EXPECT_THAT(alone.metrics, SizeIs(alone.attempts.size()));
  }
  EXPECT_THAT(views[1].passed[0], testing::Contains(true)) << "bars are met by metrics that were read";
  EXPECT_THAT(views[2].attempts, IsEmpty());
}

}  // namespace
}  // namespace stylet::app
