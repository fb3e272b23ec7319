// From the segmentation of a real CT to a scenario whose demonstration passes, by the organ's name alone.
//
// STYLET_EVERY_ORGAN: for one organ after another; unset: for the liver.
#include "engine/app/import_organs.h"
#include "engine/app/run_session.h"
#include "engine/app/validate.h"
#include "engine/files/error.h"
#include "tests/support/author_hands.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace stylet::app {
namespace {

using ::testing::HasSubstr;

/// Of TotalSegmentator's tests; empty: not at hand.
std::filesystem::path segmentation() {
  const char* data = std::getenv("STYLET_TEST_DATA");
  return data == nullptr ? std::filesystem::path()
                         : std::filesystem::path(data) / "volumes/example_seg_fast_force_split.nii.gz";
}

class RealLabels : public ::testing::TestWithParam<const char*> {};

TEST_P(RealLabels, BecomeAScenarioWhoseDemonstrationPasses) {
  if (segmentation().empty()) GTEST_SKIP() << "STYLET_TEST_DATA is not set";
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; the torso of spheres takes the same ways";
  const support::TemporaryFolder folder;
  support::AuthorHands hands;
  ASSERT_TRUE(
      import_organs({.files = {segmentation().string()}, .target = GetParam(), .out = folder / "case"}, hands));
  const std::filesystem::path scenario = folder / "case" / "scenario.json";
  EXPECT_TRUE(validate(scenario, {}).sound());
  const SessionResult result = run_session({.scenario = scenario.string(),
                                            .stylus = "recorded",
                                            .view = SessionView::headless,
                                            .lockstep = true,
                                            .expert = "none",
                                            .film = false,
                                            .out = folder / "out"},
                                           hands);
  ASSERT_TRUE(result.training.score.has_value());
  EXPECT_TRUE(result.identical());
  EXPECT_TRUE(result.training.score->passed);
  for (const training::Metric& metric : result.training.metrics) {
    if (metric.key == "forbidden_hits") {
      EXPECT_EQ(metric.value.value_or(1), 0);
    }
    if (metric.key == "tumour_content") {
      EXPECT_GT(metric.value.value_or(0), 50);
    }
  }
}

std::vector<const char*> targets() {
  if (std::getenv("STYLET_EVERY_ORGAN") == nullptr) return {"liver"};
  return {"liver", "pancreas", "kidney_right"};
}

INSTANTIATE_TEST_SUITE_P(Targets, RealLabels, ::testing::ValuesIn(targets()));

// A name that no part has, and the scan itself where its labels are wanted.
TEST(RealLabelsRefused, SaysWhyInOneLine) {
  if (segmentation().empty()) GTEST_SKIP() << "STYLET_TEST_DATA is not set";
  const support::TemporaryFolder folder;
  struct Refused {
    std::filesystem::path file;
    std::string target, why;
  };
  for (const auto& [file, target, why] :
       {Refused{segmentation(), "lever", "no part is called so"},
        Refused{segmentation().parent_path() / "example_ct.nii.gz", "liver", "this looks like an image"}}) {
    support::AuthorHands hands;
    try {
      import_organs({.files = {file.string()}, .target = target, .out = folder / "case"}, hands);
      ADD_FAILURE() << target << " was taken";
    } catch (const files::ContentError& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "case"));
  }
}

}  // namespace
}  // namespace stylet::app
