// `stylet train --view headset` as a user runs it, in the mock runtime's headset and where there is none.
#include "engine/lab/store/lab.h"
#include "engine/recording/recording.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

namespace stylet {
namespace {

class Headset : public ::testing::Test {
protected:
  Headset() {
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.write();
  }
  /// @param runtime  a manifest; @param plan  of the mock runtime, tests/support/openxr/environment.cpp
  /// @param scenario  empty: the small one
  Outcome train(const fs::path& runtime, const std::string& plan, const std::string& more,
                const std::string& scenario = "") {
    setenv("XR_RUNTIME_JSON", runtime.c_str(), 1);
    setenv("STYLET_MOCK_OPENXR", fmt::format("{} errors={}", plan, refused().string()).c_str(), 1);
    // Where the test runs there may be a display, where it does not there is none.
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    return run(fmt::format("train {} --view headset --no-film --out {} {}",
                           scenario.empty() ? small_.path().string() : scenario, out().string(), more));
  }
  void expect_replay() const {
    const Outcome replayed = run("replay " + out().string());
    EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
    EXPECT_NE(replayed.output.find("identical: "), std::string::npos) << replayed.output;
    for (const char* name : {"debrief.html", "view.png"}) EXPECT_GT(fs::file_size(out() / name), 500u) << name;
    EXPECT_FALSE(fs::exists(out() / "session.mp4")) << "--no-film";
  }
  /// Words of a plan: the left eye, which looks at the panel, is written down.
  std::string look_at_panel() const { return fmt::format(" yaw=70 pitch=-35 left={}", eye().string()); }
  /// Pixels of the left eye that have the colour of the panel's ground, as nothing else in the room.
  int panel_pixels() const {
    const std::string ppm = read_text(eye());
    int count = 0;
    for (std::size_t i = ppm.size() % 3; i + 2 < ppm.size(); i += 3) {
      const auto is = [&](std::size_t channel, int value) {
        return std::abs(static_cast<unsigned char>(ppm[i + channel]) - value) <= 2;
      };
      count += is(0, 18) && is(1, 24) && is(2, 29) ? 1 : 0;
    }
    return count;
  }
  fs::path eye() const { return folder_ / "left.ppm"; }
  fs::path out() const { return folder_ / "out"; }
  fs::path refused() const { return folder_ / "refused"; }

  support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

TEST_F(Headset, WithoutARuntimeTheSessionGoesOnWithOneLine) {
  const Outcome outcome = train("/nonexistent.json", "", "--device hand");
  EXPECT_NE(outcome.output.find("stylet: --view headset: no OpenXR runtime answers"), std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("going on headless\n"), std::string::npos) << outcome.output;
  // The loader says nothing, and the session went on as far as to its stylus.
  EXPECT_EQ(outcome.output.find("Error ["), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("--device hand"), std::string::npos) << outcome.output;
}

TEST_F(Headset, WithoutAHeadsetItSaysSo) {
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "absent", "--device hand");
  EXPECT_NE(outcome.output.find("sees no headset"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("--device hand: needs a headset"), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.exit_code, 2);
}

TEST_F(Headset, AWholeSessionIsBegunLedAndEndedThere) {
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "steady=100 size=96x80 menu=4 end=12" + look_at_panel(),
                                "--lockstep --expert none");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(read_text(refused()), "");
  EXPECT_GT(panel_pixels(), 100);
  const recording::Recording recording = recording::read_recording(out() / "session.rec");
  EXPECT_TRUE(recording.complete()) << recording.condition();
  std::vector<std::string> stages;
  for (const recording::EventRecord& event : recording.events)
    if (event.name == "stage") stages.emplace_back(event.text("stage"));
  ASSERT_GE(stages.size(), 2U);
  EXPECT_EQ(stages.front(), "procedure");
  EXPECT_EQ(stages.back(), "debrief");
  // The right hand of the mock moves by some mm a second.
  double moved = 0;
  for (const recording::HapticStepRecord& step : recording.haptic)
    moved = std::max(moved, (step.pose.position - recording.haptic.front().pose.position).norm());
  EXPECT_GT(moved, 0.001);
  EXPECT_LT(moved, 0.1);
  expect_replay();
}

TEST_F(Headset, AButtonAsksForTheBreathToBeHeld) {
  small_.scenario["breathing"] = {{"period_s", 1}, {"holds", {{0.02, 100}}}};
  small_.write();
  const Outcome outcome =
      train(STYLET_MOCK_OPENXR_MANIFEST, "steady=100 size=96x80 menu=2 breath=6 end=70", "--lockstep --expert none");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(read_text(refused()), "");
  const recording::Recording recording = recording::read_recording(out() / "session.rec");
  std::vector<std::string> names;
  for (const recording::EventRecord& event : recording.events) {
    if (event.name.starts_with("breath")) names.push_back(event.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"breath_out", "breath_held"}));
  double most = 0;
  for (const recording::SimulationStepRecord& step : recording.simulation) most = std::max(most, step.inspiration);
  EXPECT_GT(most, 0.9) << "the scene's own holds are for a recorded motion: here the patient breathes until asked";
  ASSERT_FALSE(recording.simulation.empty());
  EXPECT_NEAR(recording.simulation.back().inspiration, 0, 1e-3) << "held at the end of a breath";
  expect_replay();
}

TEST_F(Headset, PuncturesAreFeltInTheHandWithTheNeedle) {
  const fs::path felt = folder_ / "felt";
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "steady=20 size=96x80 stage=160 felt=" + felt.string(),
                                "--lockstep --expert none --device recorded --left-handed --seconds 1.5", "tutorial");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(read_text(refused()), "");
  const recording::Recording recording = recording::read_recording(out() / "session.rec");
  const auto punctures = std::ranges::count(recording.events, "puncture", &recording::EventRecord::name);
  ASSERT_GT(punctures, 0);
  const std::string lines = read_text(felt);
  const auto count = std::ranges::count(lines, '\n');
  EXPECT_TRUE(count > 0 && count <= punctures) << lines << punctures << " punctures; those of one frame are one";
  EXPECT_EQ(lines.find("right"), std::string::npos) << lines;
  EXPECT_NE(lines.find("left 0."), std::string::npos) << lines;
}

TEST_F(Headset, AShotIsFeltInTheHandWithTheNeedle) {
  const fs::path felt = folder_ / "felt";
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "steady=40 size=96x80 stage=160 felt=" + felt.string(),
                                "--lockstep --expert none --device recorded --seconds 4", "tutorial");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const recording::Recording recording = recording::read_recording(out() / "session.rec");
  ASSERT_EQ(std::ranges::count(recording.events, "biopsy_fired", &recording::EventRecord::name), 1);
  const std::string lines = read_text(felt);
  std::size_t full = 0;
  for (std::size_t at = lines.find("right 1"); at != std::string::npos; at = lines.find("right 1", at + 1)) ++full;
  EXPECT_EQ(full, 1U) << lines << "the punctures of the block of agar are weaker";
}

TEST_F(Headset, WhoTrainsIsAskedThereBeforeTheBriefing) {
  const fs::path records = folder_ / "lab";
  lab::store::Person ada;
  {
    lab::store::Lab lab({.folder = records, .build = "test"});
    ada = lab.enrolled("ada");
    lab.enrolled("bob");
  }
  // The session's own frames are counted anew.
  const Outcome outcome =
      train(STYLET_MOCK_OPENXR_MANIFEST, "steady=100 size=96x80 panel=4 trigger=8 menu=14 end=24" + look_at_panel(),
            fmt::format("--lockstep --expert none --ask-trainee --lab {}", records.string()));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(read_text(refused()), "");
  EXPECT_GT(panel_pixels(), 100);
  lab::store::Lab lab({.folder = records, .build = "test"});
  const auto attempts = lab.attempts();
  ASSERT_EQ(attempts.size(), 1U) << outcome.output;
  EXPECT_EQ(attempts[0].pseudonym, ada.pseudonym);
  EXPECT_EQ(attempts[0].status, "ended");
}

TEST_F(Headset, WhoGoesWhileAskedHasBegunNothing) {
  const fs::path records = folder_ / "lab";
  lab::store::Lab({.folder = records, .build = "test"}).enrolled("ada");
  for (const char* end : {"lose=6", "end=6"}) {
    const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, fmt::format("steady=100 size=96x80 {}", end),
                                  fmt::format("--lockstep --ask-trainee --lab {}", records.string()));
    EXPECT_NE(outcome.exit_code, 0) << outcome.output;
    EXPECT_FALSE(fs::exists(out())) << end;
    EXPECT_TRUE(lab::store::Lab({.folder = records, .build = "test"}).attempts().empty());
  }
  const Outcome nowhere = train("/nonexistent.json", "", fmt::format("--ask-trainee --lab {}", records.string()));
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_NE(nowhere.output.find("no display and no headset"), std::string::npos) << nowhere.output;
}

TEST_F(Headset, LostInTheMiddleASessionOfItsHandsEnds) {
  const Outcome outcome =
      train(STYLET_MOCK_OPENXR_MANIFEST, "steady=100 size=96x80 menu=2 panel=4 panel2=6 lose=11" + look_at_panel(),
            "--lockstep --expert none");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(panel_pixels(), 0) << "hidden by two presses";
  EXPECT_NE(outcome.output.find("the headset has gone (connection, power or its runtime); nothing leads the needle: "
                                "the end\n"),
            std::string::npos)
      << outcome.output;
  expect_replay();
}

TEST_F(Headset, LostInTheMiddleARecordedMotionGoesOn) {
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "steady=100 size=96x80 menu=2 lose=6",
                                "--lockstep --expert none --device recorded");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("; going on headless\n"), std::string::npos) << outcome.output;
  EXPECT_NEAR(recording::read_recording(out() / "session.rec").haptic.back().time_s, 1, 0.01);
  expect_replay();
}

}  // namespace
}  // namespace stylet
