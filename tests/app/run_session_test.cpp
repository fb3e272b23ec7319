// A program of its own that runs a session: a lab's server, as far as the library is concerned.
#include "engine/app/run_session.h"

#include "engine/app/debrief_recording.h"
#include "engine/app/replay.h"
#include "engine/files/error.h"
#include "engine/lab/store/lab.h"
#include "tests/readers/small_scenario.h"
#include "tests/support/x_keyboard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace stylet::app {
namespace {

using ::testing::HasSubstr;

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Remembers what it hears, and asks for the end from the so manyth report of a task's progress on.
class Listener final : public SessionObserver {
public:
  void progress(const std::string& task, double /*share*/) override {
    if (task.starts_with("Session in ")) ++session_steps;
    if (tasks.empty() || tasks.back() != task) tasks.push_back(task);
  }
  void note(Note kind, const std::string& text) override {
    if (kind != Note::warning) notes.push_back(text);
  }
  bool stop_requested() override {
    if (!stop_when_there.empty() && std::filesystem::exists(stop_when_there)) return true;
    return stop_at_step > 0 && session_steps >= stop_at_step && !answered;
  }
  void stop_answered() override { answered = true; }
  void measured(const SessionResult& result) override {
    identical_when_measured = result.identical();
    kept_when_measured = std::filesystem::exists(result.folder / "session.json") &&
                         std::filesystem::exists(result.folder / "session.rec");
  }

  int stop_at_step = 0;  ///< 0: never
  int session_steps = 0;
  bool answered = false;
  bool identical_when_measured = false;
  bool kept_when_measured = false;
  std::filesystem::path stop_when_there;  ///< asks for the end once this file exists
  std::vector<std::string> tasks;
  std::vector<std::string> notes;
};

class RunSession : public ::testing::Test {
protected:
  RunSession() { files_.write(); }
  SessionSettings settings() const {
    return {.scenario = files_.path().string(),
            .view = SessionView::headless,
            .lockstep = true,
            .expert = "none",
            .film = false,
            .out = files_.folder / "out"};
  }

  readers::test::SmallScenario files_;
};

TEST_F(RunSession, LeavesItsResultsAndReplays) {
  Listener listener;
  const SessionResult result = run_session(settings(), listener);
  EXPECT_TRUE(result.drawn) << result.not_drawn_because;
  EXPECT_TRUE(result.identical());
  EXPECT_TRUE(listener.identical_when_measured) << "the numbers were there before the pictures";
  EXPECT_TRUE(listener.kept_when_measured) << "and in the folder";
  EXPECT_NEAR(result.report.run.duration_s, 1, 0.05);
  EXPECT_EQ(result.report.device, "recorded stylus");
  for (const char* name : {"session.rec", "session.json", "force.csv", "debrief.html", "view.png"}) {
    EXPECT_TRUE(std::filesystem::exists(result.folder / name)) << name;
  }
  Listener again;
  Replay replay({.recording = result.folder.string()}, again);
  EXPECT_TRUE(replay.run());
  EXPECT_EQ(replay.state_hash(), result.report.state_hash);
  EXPECT_THAT(again.notes.front(), HasSubstr("session.rec: "));
}

TEST_F(RunSession, APathThatIsNoUtf8WorksFromStartToDebrief) {
  const std::filesystem::path folder = files_.folder / "caf\xE9";
  const std::filesystem::path content = files_.path().parent_path();
  std::filesystem::create_directory(folder);
  for (const auto& entry : std::filesystem::directory_iterator(content)) {
    if (entry.path() != folder) std::filesystem::copy(entry, folder / entry.path().filename());
  }
  SessionSettings session = settings();
  session.scenario = (folder / files_.path().filename()).string();
  session.out = folder / "out";
  session.seconds = 0.1;
  Listener listener;
  const SessionResult result = run_session(session, listener);
  EXPECT_TRUE(result.drawn) << result.not_drawn_because;
  EXPECT_TRUE(result.identical());
  Listener again;
  debrief_recording({.recording = result.folder.string(), .expert = "none", .out = folder / "again"}, again);
  EXPECT_TRUE(std::filesystem::exists(folder / "again" / "debrief.html"));
}

TEST_F(RunSession, ANameThatIsTakenIsToldBeforeTheSession) {
  for (const char* name : {"session.json", "session.rec", "debrief.html", "force.csv"}) {
    SessionSettings session = settings();
    session.out = files_.folder / (std::string("out_") + name);
    std::filesystem::create_directories(session.out / name);
    Listener listener;
    try {
      run_session(session, listener);
      ADD_FAILURE() << name;
    } catch (const files::ContentError& error) {
      EXPECT_THAT(error.what(), HasSubstr((session.out / name).string() + ": cannot write results here (a folder"));
    }
    EXPECT_EQ(listener.session_steps, 0) << "nothing was done that could be lost";
  }
}

TEST_F(RunSession, EndsEarlyWhereItsObserverAsksForIt) {
  Listener listener;
  listener.stop_at_step = 5;
  const SessionResult result = run_session(settings(), listener);
  EXPECT_TRUE(listener.answered);
  EXPECT_TRUE(result.drawn) << "asked for once";
  EXPECT_LT(result.report.run.duration_s, 0.5);
}

TEST_F(RunSession, ADebriefThatIsWrittenStaysWhenTheRestIsStopped) {
  SessionSettings wanted = settings();
  wanted.film = true;
  wanted.seconds = 0.3;
  Listener listener;
  listener.stop_when_there = wanted.out / "debrief.html";
  const SessionResult result = run_session(wanted, listener);
  EXPECT_TRUE(std::filesystem::exists(result.folder / "debrief.html"));
  EXPECT_TRUE(std::filesystem::exists(result.folder / "session.json"));
  EXPECT_TRUE(result.page_written);
  EXPECT_FALSE(result.drawn) << "it was there before all of the rest";
  EXPECT_FALSE(std::filesystem::exists(result.folder / "session.mp4"));
}

TEST_F(RunSession, ADebriefOfWhatWasKeptIsThatOfTheReplay) {
  SessionSettings wanted = settings();
  wanted.seconds = 0.5;
  Listener listener;
  const SessionResult result = run_session(wanted, listener);
  Listener again;
  debrief_recording({.recording = result.folder.string(), .expert = "none", .out = files_.folder / "again"}, again);
  for (const char* name : {"debrief.json", "debrief.csv", "path.csv", "debrief.html"}) {
    EXPECT_TRUE(read_text(result.folder / name) == read_text(files_.folder / "again" / name)) << name;
  }
}

/// A trainee at the window: presses the next key whenever the course has come to the stage that it is for.
class Trainee final : public SessionObserver {
public:
  explicit Trainee(std::vector<std::string> keys) : keys_(std::move(keys)) {}
  bool stop_requested() override {
    if (given_up()) return true;
    const bool held_back =
        pressed_ + 1 == keys_.size() && !last_key_when_there.empty() && !std::filesystem::exists(last_key_when_there);
    if (++frames_ % 8 == 0 && pressed_ < keys_.size() && !held_back && keyboard_.press(keys_[pressed_])) ++pressed_;
    return false;
  }
  void measured(const SessionResult& result) override {
    measured_before_replay = !result.report.replay_identical.has_value();
    waits = result.waits_for_user;
    numbers_kept = std::filesystem::exists(result.folder / "session.json");
    ++sessions;
  }
  void left(const SessionResult& result) override { behind.push_back(result); }
  bool given_up() const { return frames_ > 4000; }

  bool measured_before_replay = false;
  bool waits = false;
  bool numbers_kept = false;
  int sessions = 0;
  std::vector<SessionResult> behind;
  std::filesystem::path last_key_when_there;  ///< waits for this file

private:
  support::XKeyboard keyboard_;
  std::vector<std::string> keys_;
  std::size_t pressed_ = 0;
  int frames_ = 0;
};

TEST_F(RunSession, TheWindowStaysWithTheScoreUntilTheTraineeLeaves) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  SessionSettings wanted = settings();
  wanted.view = SessionView::window;
  wanted.stylus = "mouse";
  wanted.lockstep = false;
  // Start, save two images, finish; again; start, save one, finish; leave.
  Trainee trainee({"Return", "F12", "F12", "Return", "BackSpace", "Return", "F12", "Return", "q"});
  const SessionResult result = run_session(wanted, trainee);
  ASSERT_FALSE(trainee.given_up());
  EXPECT_TRUE(trainee.waits);
  EXPECT_TRUE(trainee.numbers_kept);
  EXPECT_TRUE(trainee.measured_before_replay) << "score and buttons do not wait for it";
  EXPECT_EQ(trainee.sessions, 2);
  ASSERT_EQ(trainee.behind.size(), 1u);
  EXPECT_EQ(trainee.behind.front().folder.filename(), "attempt-1") << "what was done before is not written over";
  EXPECT_EQ(result.folder.filename(), "out");
  const auto numbers = nlohmann::json::parse(read_text(result.folder / "session.json"));
  ASSERT_EQ(numbers["attempts_before"].size(), 1u);
  EXPECT_EQ(numbers["attempts_before"][0]["folder"], "attempt-1");
  EXPECT_THAT(read_text(result.folder / "debrief.html"), HasSubstr("attempt-1/debrief.html"));
  ASSERT_EQ(numbers["saved_images"].size(), 1u);
  EXPECT_EQ(numbers["saved_images"][0]["file"], "ultrasound-01.png");
  for (const char* image :
       {"out/ultrasound-01.png", "out/attempt-1/ultrasound-01.png", "out/attempt-1/ultrasound-02.png"}) {
    EXPECT_TRUE(std::filesystem::exists(files_.folder / image)) << image;
  }
  EXPECT_FALSE(std::filesystem::exists(files_.folder / "out/ultrasound-02.png")) << "of the attempt before";
  EXPECT_THAT(read_text(result.folder / "debrief.html"), HasSubstr("<b>Saved image 1</b>"));
  EXPECT_THAT(read_text(files_.folder / "out/attempt-1/debrief.html"), HasSubstr("<b>Saved image 2</b>"));
  for (const auto& folder : {trainee.behind.front().folder, result.folder}) {
    for (const char* name : {"session.rec", "session.json", "debrief.html"}) {
      EXPECT_TRUE(std::filesystem::exists(folder / name)) << folder / name;
    }
  }
}

TEST_F(RunSession, AnAttemptThatWasBrokenOffGetsItsDebriefBehindTheScoreOfTheLast) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  SessionSettings wanted = settings();
  wanted.view = SessionView::window;
  wanted.stylus = "mouse";
  wanted.lockstep = false;
  wanted.trainee = {.name = "ada", .lab = files_.folder / "lab"};
  // Start, again; start, finish; leave.
  Trainee trainee({"Return", "BackSpace", "Return", "Return", "q"});
  trainee.last_key_when_there = wanted.out / "attempt-1" / "debrief.html";
  const SessionResult result = run_session(wanted, trainee);
  ASSERT_FALSE(trainee.given_up());
  EXPECT_EQ(trainee.sessions, 1) << "only the last one is looked at";
  EXPECT_EQ(result.folder.filename(), "out");
  EXPECT_TRUE(result.identical()) << "the replay of the last one comes before the debrief of the others";
  const auto numbers = nlohmann::json::parse(read_text(result.folder / "session.json"));
  ASSERT_EQ(numbers["attempts_before"].size(), 1u);
  EXPECT_EQ(numbers["attempts_before"][0]["folder"], "attempt-1");
  // Who tries again has failed the attempt before.
  lab::store::Lab lab({.folder = wanted.trainee.lab, .build = "test"});
  const auto kept = lab.attempts();
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].status, "aborted");
  EXPECT_EQ(kept[1].status, "ended");
  EXPECT_EQ(kept[0].mode, "graded");
  EXPECT_TRUE(kept[0].counts() && !kept[0].succeeded());
  EXPECT_FALSE(lab.metrics(kept[0].id).empty());
}

TEST_F(RunSession, DebriefLeadsToTheFilmThatLiesBesideIt) {
  const auto leads = [](const std::filesystem::path& folder) {
    std::ifstream in(folder / "debrief.html");
    const std::string page((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    EXPECT_FALSE(page.empty()) << folder;
    return page.find("href=\"session.mp4#t=") != std::string::npos;
  };
  Listener listener;
  SessionSettings filmed = settings();
  filmed.film = true;
  const SessionResult result = run_session(filmed, listener);
  EXPECT_TRUE(std::filesystem::exists(result.folder / "session.mp4"));
  EXPECT_TRUE(leads(result.folder));
  debrief_recording({.recording = result.folder.string(), .expert = "none", .out = result.folder}, listener);
  EXPECT_TRUE(leads(result.folder)) << "written again";
  const std::filesystem::path elsewhere = files_.folder / "elsewhere";
  debrief_recording({.recording = result.folder.string(), .expert = "none", .out = elsewhere}, listener);
  EXPECT_FALSE(leads(elsewhere));
  run_session(settings(), listener);
  EXPECT_FALSE(std::filesystem::exists(result.folder / "session.mp4")) << "a later session has none";
  EXPECT_FALSE(leads(result.folder));
}

TEST_F(RunSession, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  Listener listener;
  listener.stop_at_step = 5;
  run_session(settings(), listener);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

}  // namespace
}  // namespace stylet::app
