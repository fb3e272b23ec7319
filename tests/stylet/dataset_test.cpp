// Data sets as a user makes them: by one process, by many, in several goes; the bytes are the same.
#include "engine/picture/picture.h"
#include "tests/mesh/shapes.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <iterator>
#include <map>
#include <sstream>
#include <vector>

namespace stylet {
namespace {

using nlohmann::json;

class Dataset : public ::testing::Test {
protected:
  static constexpr int kFrames = 3;

  static void SetUpTestSuite() {
    small = new readers::test::SmallScenario;
    small->probe["scan_lines"] = 48;
    small->probe["samples"] = 96;
    // Into the ball beside the probe, within 0.4 s of motion.
    small->motion["tracks"]["stylus"] = {{0, 0.1, 0.03, 0.22, 0, 1, 0, 0}, {0.4, 0.1, 0.03, 0.17, 0, 1, 0, 0}};
    small->write();
    whole = new Outcome(make("whole"));
  }
  static void TearDownTestSuite() {
    delete whole;
    delete small;
  }

  static fs::path folder(const std::string& name) { return small->folder / name; }
  static std::string options(const std::string& name) {
    return fmt::format("render {} --ultrasound --random {} --seed 7 --ultrasound-size 96x72 --previews 2 --out {} ",
                       small->path().string(), kFrames, folder(name).string());
  }
  static Outcome make(const std::string& name, const std::string& more = "") { return run(options(name) + more); }

  static std::map<std::string, std::string> bytes(const std::string& name) {
    std::map<std::string, std::string> files;
    for (const std::string& file : files_below(folder(name))) files[file] = read_text(folder(name) / file);
    return files;
  }
  static json about(int frame) {
    return json::parse(read_text(folder("whole") / fmt::format("frame_{:06}.json", frame)));
  }

  static readers::test::SmallScenario* small;
  static Outcome* whole;
};
readers::test::SmallScenario* Dataset::small = nullptr;
Outcome* Dataset::whole = nullptr;

TEST_F(Dataset, HoldsImageLabelsAndWhatTheyAreMadeOf) {
  ASSERT_EQ(whole->exit_code, 0) << whole->output;
  EXPECT_EQ(
      files_below(folder("whole")),
      (std::set<std::string>{"frame_000000.json", "frame_000001.json", "frame_000002.json", "image_000000.png",
                             "image_000001.png", "image_000002.png", "labels_000000.png", "labels_000001.png",
                             "labels_000002.png", "manifest.json", "preview_000000.png", "preview_000002.png"}));
  const json manifest = json::parse(read_text(folder("whole") / "manifest.json"));
  EXPECT_EQ(manifest["labels"][3]["name"], "tumour");
  std::set<std::string> images;
  std::set<json> poses;
  for (int frame = 0; frame < kFrames; ++frame) {
    images.insert(bytes("whole")[fmt::format("image_{:06}.png", frame)]);
    const json made_of = about(frame);
    poses.insert(made_of["transforms"]["ProbeToTracker"]);
    const double attenuation = made_of["tissues"]["liver"]["attenuation_db_per_cm_mhz"];
    EXPECT_NEAR(attenuation, 0.5, 0.1);
    EXPECT_NE(attenuation, 0.5);
    EXPECT_EQ(made_of["tissues"]["bone"]["impedance_rayl"], 6e6) << "bone keeps its values";
    EXPECT_EQ(made_of["needle"]["nodes_m"].size(), 9u);
  }
  EXPECT_EQ(images.size(), std::size_t{kFrames});
  EXPECT_EQ(poses.size(), std::size_t{kFrames});
}

TEST_F(Dataset, ShardsGiveTheBytesOfOneRun) {
  const fs::path job = fs::path(STYLET_SOURCE_DIR) / "tools" / "jobs" / "slurm.sh";
  for (int task = 1; task >= 0; --task) {
    const std::string command = fmt::format(
        "SLURM_ARRAY_TASK_ID={} SLURM_ARRAY_TASK_COUNT=2 PATH='{}':$PATH '{}' {} {} 7 {} --ultrasound-size 96x72 "
        "--previews 2",
        task, fs::path(STYLET_COMMAND).parent_path().string(), job.string(), small->path().string(), kFrames,
        folder("shards").string());
    const Outcome outcome = run(fmt::format("-c \"{}\"", command), "/bin/sh");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }
  EXPECT_EQ(bytes("shards"), bytes("whole"));
}

TEST_F(Dataset, WhatIsTornIsMadeAgainAndTheRestIsKept) {
  fs::copy(folder("whole"), folder("torn"));
  fs::resize_file(folder("torn") / "image_000001.png", 100);
  fs::remove(folder("torn") / "frame_000002.json");
  const auto before = fs::last_write_time(folder("torn") / "image_000000.png");
  const Outcome outcome = make("torn");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("2 frames drawn, 1 were there; 3 of 3"), std::string::npos) << outcome.output;
  EXPECT_EQ(bytes("torn"), bytes("whole"));
  EXPECT_EQ(fs::last_write_time(folder("torn") / "image_000000.png"), before);
}

TEST_F(Dataset, AFrameAloneIsThatOfTheWhole) {
  const Outcome outcome = make("alone", "--only 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto alone = bytes("alone");
  EXPECT_EQ(alone.size(), 4u);  // image, labels, about it; manifest
  for (const auto& [name, content] : alone) EXPECT_EQ(content, bytes("whole")[name]) << name;
}

TEST_F(Dataset, TheSequenceOfAMotionHoldsItsPictures) {
  const Outcome outcome =
      run(fmt::format("render {} --ultrasound --labels --fps 20 --to 0.1 --ultrasound-size 96x72 --out {}",
                      small->path().string(), folder("motion").string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const json manifest = json::parse(read_text(folder("motion") / "manifest.json"));
  const std::string sequence = read_text(folder("motion") / manifest["sequence"].get<std::string>());
  const std::string end_of_header = "ElementDataFile = LOCAL\n";
  const std::size_t pixels = sequence.find(end_of_header) + end_of_header.size();
  // The tumour's centre lies 50 mm below the face and 10 mm to its side: where the file itself says that this is.
  const std::string key = "Seq_Frame0000_ImageToProbeTransform = ";
  std::istringstream text(sequence.substr(sequence.find(key) + key.size()));
  const std::vector<double> to_probe{std::istream_iterator<double>(text), {}};
  ASSERT_GE(to_probe.size(), 16u);
  const int column = static_cast<int>(std::lround((10 - to_probe[3]) / to_probe[0]));
  const int row = static_cast<int>(std::lround((50 - to_probe[11]) / to_probe[9]));
  ASSERT_TRUE(column > 0 && column < 96 && row > 0 && row < 72) << column << ' ' << row;
  ASSERT_EQ(sequence.size(), pixels + 3 * 96 * 72);
  ASSERT_EQ(manifest["frames"].size(), 3u);
  EXPECT_EQ(files_below(folder("motion")).size(), 2u + 3 * 2 + 1) << "manifest, sequence, images, labels, a preview";
  int lit = 0;
  for (std::size_t frame = 0; frame < 3; ++frame) {
    const picture::Picture picture =
        picture::read_png(folder("motion") / manifest["frames"][frame]["ultrasound"].get<std::string>());
    for (std::size_t i = 0; i < 96 * 72; ++i) {
      ASSERT_EQ(static_cast<std::uint8_t>(sequence[pixels + frame * 96 * 72 + i]), picture.rgba[4 * i]);
      lit += picture.rgba[4 * i] > 20 ? 1 : 0;
    }
    const picture::Picture labels =
        picture::read_png(folder("motion") / manifest["frames"][frame]["ultrasound_labels"].get<std::string>());
    EXPECT_EQ(std::make_pair(labels.width, labels.height), std::make_pair(96, 72));
    EXPECT_EQ(labels.at(0, 0)[0], 0);
    EXPECT_EQ(manifest["labels"][labels.at(column, row)[0]]["name"], "tumour");
  }
  EXPECT_GT(lit, 1000);
}

TEST_F(Dataset, RefusesFoldersOfOtherDatasetsAndInvalidOptions) {
  const auto before = bytes("whole");
  for (const auto& [more, said] : std::map<std::string, std::string>{
           {"--tilt 3", "\"ranges\" differs"}, {"--shard 2/2", "I from 0 to N - 1"}, {"--slide -1", "--slide"}}) {
    const Outcome outcome = make("whole", more);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
    EXPECT_NE(outcome.output.find(said), std::string::npos) << outcome.output;
    EXPECT_EQ(outcome.lines(), 1) << outcome.output;
  }
  EXPECT_EQ(bytes("whole"), before);
}

TEST_F(Dataset, OptionsThatWouldDoNothingAreRefused) {
  const std::string plain =
      fmt::format("render {} --ultrasound --out {} ", small->path().string(), folder("refused").string());
  for (const char* alone : {"--shard 0/2", "--only 1", "--slide 3"}) {
    const Outcome outcome = run(plain + alone);
    EXPECT_NE(outcome.exit_code, 0) << alone;
    EXPECT_NE(outcome.output.find("--random"), std::string::npos) << outcome.output;
  }
  for (const char* wrong :
       {"--only 3", "--only 1 --shard 0/2", "--attenuation 1.5", "--attenuation nan", "--tilt -1"}) {
    const Outcome outcome = make("refused", wrong);
    EXPECT_NE(outcome.exit_code, 0) << wrong;
    EXPECT_EQ(outcome.lines(), 1) << outcome.output;
  }
  EXPECT_FALSE(fs::exists(folder("refused")));
}

}  // namespace
}  // namespace stylet
