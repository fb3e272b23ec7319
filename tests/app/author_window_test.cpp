// An author at the window, by mouse and keys.
#include "engine/app/author_window.h"

#include "engine/app/run_session.h"
#include "engine/app/validate.h"
#include "tests/readers/small_scenario.h"
#include "tests/support/author_hands.h"
#include "tests/support/x_keyboard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <vector>

namespace stylet::app {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

using support::XKeyboard;
using Hands = support::AuthorHands;

class AuthorWindow : public ::testing::Test {
protected:
  AuthorWindow() {
    // Seen from the front, the ball of liver in the middle.
    files_.scenario["camera"] = {{"eye", {0.1, 0.0, 0.4}}, {"look_at", {0.1, 0, 0}}, {"up", {0, 1, 0}}};
    files_.write();
  }
  readers::test::SmallScenario files_;
};

TEST_F(AuthorWindow, AScenarioPutWithTheMouseIsSavedSoundAndTrained) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  Hands hands;
  hands.click(640, 330);  // an organ: the target
  hands.key("2");
  hands.click(700, 330);  // skin: the entry
  hands.key("3");
  hands.click(640, 420);  // skin: the probe
  hands.key("c");
  hands.key("s");
  hands.key("q");
  EXPECT_TRUE(author_scenario({.scenario = files_.path().string(), .language = "en"}, hands));
  ASSERT_FALSE(hands.given_up());
  const auto saved = nlohmann::json::parse(text_of(files_.path()));
  const auto target = saved["targets"][0]["centre"];
  EXPECT_FALSE(saved["targets"][0].contains("organ"));
  EXPECT_NEAR(target[0], 0.1, 2e-3) << "in the middle of the window";
  EXPECT_GT(target[1], 0.0) << "above its middle";
  EXPECT_NEAR(target[2], 0.0, 8e-3) << "in the middle of the organ";
  EXPECT_LT(saved["probe"]["position"][1].get<double>(), -0.01);
  EXPECT_EQ(saved["motion"], "scenario_motion.json");
  EXPECT_EQ(saved["camera"]["vertical_fov_deg"], 35);
  EXPECT_EQ(saved["bodies"], files_.scenario["bodies"]);
  const Verdict verdict = validate(files_.path(), {});
  EXPECT_TRUE(verdict.sound());
  EXPECT_TRUE(verdict.warnings.empty()) << verdict.warnings.front();
  Hands trainee;
  const SessionResult result = run_session({.scenario = files_.path().string(),
                                            .view = SessionView::headless,
                                            .lockstep = true,
                                            .seconds = 0.3,
                                            .expert = "none",
                                            .film = false,
                                            .out = files_.folder / "out"},
                                           trainee);
  EXPECT_NEAR(result.report.run.duration_s, 0.3, 0.05);
}

TEST_F(AuthorWindow, WhatIsNotSavedOutlivesALostDevice) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  Hands hands;
  hands.click(640, 330);
  hands.key("1");  // so that what came before has been read
  hands.deeds.emplace_back([](XKeyboard&) -> bool { throw std::runtime_error("the device is lost"); });
  EXPECT_THROW(author_scenario({.scenario = files_.path().string(), .language = "en"}, hands), std::runtime_error);
  const auto kept = nlohmann::json::parse(text_of(files_.folder.path() / "scenario_unsaved.json"));
  EXPECT_NE(kept["targets"], files_.scenario["targets"]);
  EXPECT_THAT(hands.notes, ::testing::Contains(::testing::HasSubstr("scenario_unsaved.json")));
}

TEST_F(AuthorWindow, OnlyWithCtrlHeldDoesZUndo) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  Hands hands;
  hands.stops = true;
  hands.click(640, 330);
  hands.key("z");
  hands.key("1");  // so that what came before has been read
  hands.key("1");
  author_scenario({.scenario = files_.path().string(), .language = "en"}, hands);
  const auto kept = files_.folder.path() / "scenario_unsaved.json";
  ASSERT_TRUE(std::filesystem::exists(kept)) << "what was edited is still there";
  Hands undone;
  undone.stops = true;
  undone.click(640, 330);
  undone.key("z", XKeyboard::kControl);
  undone.key("z", XKeyboard::kControl | XKeyboard::kShift);
  undone.key("z", XKeyboard::kControl);
  undone.key("1");
  undone.key("1");
  std::filesystem::remove(kept);
  author_scenario({.scenario = files_.path().string(), .language = "en"}, undone);
  EXPECT_FALSE(std::filesystem::exists(kept)) << "nothing is left to be saved";
}

TEST_F(AuthorWindow, TabTakesTheNextTarget) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  files_.scenario["targets"] = {{{"name", "first"}, {"centre", {0.08, 0, 0}}, {"radius_mm", 5}},
                                {{"name", "second"}, {"centre", {0.11, 0.01, 0}}, {"radius_mm", 6}}};
  files_.write();
  Hands hands;
  hands.key("Tab");
  hands.key("equal");
  hands.key("s");
  hands.key("Tab");
  hands.key("minus");
  hands.key("s");
  hands.key("q");
  author_scenario({.scenario = files_.path().string(), .language = "en"}, hands);
  ASSERT_FALSE(hands.given_up());
  const auto saved = nlohmann::json::parse(text_of(files_.path()))["targets"];
  EXPECT_EQ(saved[0]["radius_mm"], 4);
  EXPECT_EQ(saved[1]["radius_mm"], 7);
  EXPECT_EQ(saved[0]["centre"][0], 0.08);
  EXPECT_EQ(saved[1]["centre"][0], 0.11);
}

TEST_F(AuthorWindow, WhatIsNotSavedIsKeptWhenTheWindowIsTakenAway) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  const std::string before = text_of(files_.path());
  Hands hands;
  hands.stops = true;
  hands.click(640, 330);
  hands.key("z", XKeyboard::kControl);
  hands.key("z", XKeyboard::kControl);  // undone once more, which is nothing
  hands.click(640, 340);
  hands.key("q");  // asks, and stays
  hands.key("q");
  author_scenario({.scenario = files_.path().string(), .language = "de"}, hands);
  EXPECT_EQ(text_of(files_.path()), before);
  const auto kept = files_.folder.path() / "scenario_unsaved.json";
  ASSERT_TRUE(std::filesystem::exists(kept));
  EXPECT_TRUE(nlohmann::json::parse(text_of(kept))["targets"][0].contains("centre"));
  EXPECT_THAT(hands.notes, ::testing::Contains(::testing::HasSubstr("scenario_unsaved.json")));
}

}  // namespace
}  // namespace stylet::app
