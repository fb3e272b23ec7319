// What "Try again" leaves of the attempt before it.
#include "engine/app/kept_attempts.h"

#include "engine/app/saved_images.h"

#include "engine/recording/recording_writer.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace stylet::app {
namespace {

namespace fs = std::filesystem;

training::TrainingReport scored(double total) {
  training::TrainingReport report;
  report.score = training::Score{.total = total, .pass_mark = 70, .done = true, .passed = total >= 70};
  return report;
}

std::string keep(KeptAttempts& attempts, const fs::path& folder, double total) {
  recording::UnfinishedRecording file(folder);
  {
    recording::RecordingWriter writer(file.path(), {.build = "test", .scenario = "liver_biopsy"});
    writer.finish();
  }
  file.keep();
  const scanner::SavedImages saved{{.png = "\x89PNG", .time_s = 3, .depth = 0.12, .distances = {0.0234}}};
  return attempts.keep(file, {.scenario = "liver_biopsy", .run = {.duration_s = 12}, .saved_images = facts_of(saved)},
                       scored(total), saved);
}

TEST(KeptAttempts, LieInFoldersOfTheirOwnWithScoreAndRecording) {
  const support::TemporaryFolder folder;
  const fs::path out = folder / "out";
  fs::create_directories(out / "attempt-4");  // of an earlier session
  KeptAttempts attempts(out);
  EXPECT_TRUE(attempts.empty());
  const std::string said = keep(attempts, out, 54);
  EXPECT_NE(said.find("attempt 1: 54 of 100, not passed"), std::string::npos) << said;
  EXPECT_NE(said.find("attempt-5"), std::string::npos) << "nothing is written over";
  keep(attempts, out, 81);
  EXPECT_TRUE(recording::cut_off_recordings(out).empty()) << "the recordings have moved";
  ASSERT_EQ(attempts.without_page().size(), 2U);
  for (const fs::path& kept : attempts.without_page()) {
    EXPECT_TRUE(recording::read_recording(recording::find_recording(kept)).complete()) << kept;
  }
  const auto json = nlohmann::json::parse(std::ifstream(out / "attempt-6" / "session.json"));
  EXPECT_EQ(json["score"]["total"], 81);
  EXPECT_TRUE(fs::exists(out / "attempt-6" / json["saved_images"].at(0).at("file")));
  EXPECT_EQ(json["saved_images"][0]["distances_m"], nlohmann::json::array({0.0234}));
  const auto pictures = saved_pictures(out / "attempt-6");
  ASSERT_EQ(pictures.size(), 1U);
  EXPECT_EQ(pictures[0].time_s, 3);
  EXPECT_EQ(pictures[0].caption, "measured 23.4 mm");
  EXPECT_EQ(pictures[0].png, "\x89PNG");
  std::ofstream(out / "attempt-6" / "ultrasound-01.png") << "<script>";
  EXPECT_TRUE(saved_pictures(out / "attempt-6").empty()) << "no image";
  for (const char* wrong : {"", "[]", R"({"saved_images": 3})", R"({"saved_images": [null, {"time_s": "now"}]})"}) {
    std::ofstream(out / "attempt-5" / "session.json") << wrong;
    EXPECT_TRUE(saved_pictures(out / "attempt-5").empty()) << wrong;
  }
  const auto list = to_json(attempts.list());
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0]["folder"], "attempt-5");
  EXPECT_EQ(list[0]["total"], 54);
  EXPECT_EQ(list[1]["passed"], true);
}

TEST(KeptAttempts, ThatWereOverTakeAllTheirFilesWithThem) {
  const support::TemporaryFolder folder;
  const fs::path out = folder / "out";
  KeptAttempts attempts(out);
  keep(attempts, out, 54);  // broken off
  for (const char* name : {"session.rec", "session.json", "force.csv", "debrief.html", "view.png", "notes.txt"}) {
    std::ofstream(out / name) << name;
  }
  const fs::path aside = attempts.put_aside({.run = {.duration_s = 30}}, scored(75));
  EXPECT_EQ(aside, out / "attempt-2");
  for (const char* name : {"session.rec", "session.json", "force.csv", "debrief.html", "view.png"}) {
    EXPECT_TRUE(fs::exists(aside / name)) << name;
    EXPECT_FALSE(fs::exists(out / name)) << name << " would be taken for one of the next attempt";
  }
  EXPECT_TRUE(fs::exists(out / "notes.txt")) << "is the user's";
  EXPECT_EQ(attempts.without_page(), std::vector<fs::path>{out / "attempt-1"}) << "only that has no debrief";
  EXPECT_EQ(to_json(attempts.list())[1]["total"], 75);
}

}  // namespace
}  // namespace stylet::app
