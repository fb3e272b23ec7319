// A program of its own that runs a session: a lab's server, as far as the library is concerned.
#include "engine/app/run_session.h"

#include "engine/app/replay.h"
#include "tests/readers/small_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace stylet::app {
namespace {

using ::testing::HasSubstr;

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
  bool stop_requested() override { return stop_at_step > 0 && session_steps >= stop_at_step && !answered; }
  void stop_answered() override { answered = true; }
  void measured(const SessionResult& result) override { identical_when_measured = result.identical(); }

  int stop_at_step = 0;  ///< 0: never
  int session_steps = 0;
  bool answered = false;
  bool identical_when_measured = false;
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

TEST_F(RunSession, EndsEarlyWhereItsObserverAsksForIt) {
  Listener listener;
  listener.stop_at_step = 5;
  const SessionResult result = run_session(settings(), listener);
  EXPECT_TRUE(listener.answered);
  EXPECT_TRUE(result.drawn) << "asked for once";
  EXPECT_LT(result.report.run.duration_s, 0.5);
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
