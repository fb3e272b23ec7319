// From a label volume to a session with a score, without a coordinate: import by names, correct with the mouse,
// train.
#include "engine/app/author_window.h"
#include "engine/app/import_organs.h"
#include "engine/app/run_session.h"
#include "engine/app/validate.h"
#include "engine/readers/scenario.h"
#include "engine/render/room_layout.h"
#include "tests/support/author_hands.h"
#include "tests/support/label_torso.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace stylet::app {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;

json json_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return json::parse(file);
}

class ImportedPatient : public ::testing::Test {
protected:
  ImportedPatient() {
    std::ofstream(folder_ / "labels.nii", std::ios::binary)
        << support::nifti_of(support::torso_labels(support::kSanitized ? 0.006 : 0.003));
    EXPECT_TRUE(import_organs(
        {.files = {(folder_ / "labels.nii").string()}, .target = "liver", .out = folder_ / "case1"}, hands_));
  }
  std::filesystem::path scenario() const { return folder_ / "case1" / "scenario.json"; }

  support::TemporaryFolder folder_;
  support::AuthorHands hands_;
};

TEST_F(ImportedPatient, IsSoundAndScoredByWhatTheImportProposed) {
  EXPECT_THAT(hands_.notes, Contains(HasSubstr("the body is derived")));
  EXPECT_THAT(hands_.notes, Contains(HasSubstr("is made up")));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "case1" / "side.json")) << "to be corrected, and given as --side";
  const Verdict verdict = validate(scenario(), {});
  EXPECT_TRUE(verdict.sound());
  const content::Scene scene = readers::load_scene(scenario());
  const render::RoomLayout layout = render::room_layout(scene);
  EXPECT_TRUE(layout.draped);
  const Eigen::Vector3d probe = layout.patient_from_table.inverse() * scene.probe.pose.position;
  EXPECT_LT(layout.outside_field(layout.trunk_angle(probe), probe.y()), -0.02) << "the drape is open over the probe";
  if (support::kSanitized) return;  // a session is minutes long; its parts are tested elsewhere
  const SessionResult result = run_session({.scenario = scenario().string(),
                                            .stylus = "recorded",
                                            .view = SessionView::headless,
                                            .lockstep = true,
                                            .expert = "none",
                                            .film = false,
                                            .out = folder_ / "out"},
                                           hands_);
  ASSERT_TRUE(result.training.score.has_value());
  EXPECT_TRUE(result.identical());
  const auto metric = [&](const std::string& name) -> double {
    for (const training::Metric& each : result.training.metrics) {
      if (each.key == name && each.value) return *each.value;
    }
    ADD_FAILURE() << "no " << name;
    return -1;
  };
  EXPECT_GT(metric("tumour_content"), 30) << "the proposed way leads to the lesion";
  EXPECT_EQ(metric("forbidden_hits"), 0);
}

TEST_F(ImportedPatient, IsCorrectedWithTheMouse) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  const json before = json_of(scenario());
  hands_.click(640, 400);  // the target, in the middle of the picture
  hands_.key("2");
  hands_.click(600, 380);  // the entry
  hands_.key("s");
  hands_.key("q");
  author_scenario({.scenario = scenario().string(), .language = "en"}, hands_);
  ASSERT_FALSE(hands_.given_up());
  const json after = json_of(scenario());
  EXPECT_TRUE(after["targets"][0].contains("centre"));
  EXPECT_EQ(after["motion"], "scenario_motion.json");
  EXPECT_EQ(after["organs"], before["organs"]);
  EXPECT_TRUE(validate(scenario(), {}).sound());
}

}  // namespace
}  // namespace stylet::app
