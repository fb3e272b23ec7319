// Side files: what they may say, and what an author is told about each mistake.
#include "engine/import/side_file.h"
#include "engine/files/error.h"
#include "tests/readers/generated_files.h"
#include "tests/readers/schema_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace stylet::import {
namespace {

using files::JsonFile;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::filesystem::path kShipped = std::filesystem::path(STYLET_SOURCE_DIR) / "content";

/// With `organs` and `scenario` as JSON.
std::string side_text(const std::string& organs, const std::string& scenario = {}) {
  return R"({"format": "stylet-import", "version": 1, "organs": [)" + organs + "]" +
         (scenario.empty() ? "" : ", \"scenario\": " + scenario) + "}";
}

const std::string kOrgans = R"({"id": "skin"}, {"id": "liver", "deformable": true}, {"id": "spot", "body": "liver"})";

std::string scenario(const std::string& wall, const std::string& more = {}) {
  return R"({"name": "x", "wall": {"skin": "skin")" + wall +
         R"(}, "entry": [0, 0, 0], "target": "spot", "probe": {"at": [0, 0, 0]})" + more + "}";
}

std::vector<std::string> problems(const std::string& text) {
  JsonFile file("side.json", text);
  read_side_file(file);
  return file.problems();
}

TEST(SideFile, ShortOnesHaveSensibleDefaults) {
  JsonFile file("side.json", side_text(kOrgans, scenario("")));
  const SideFile side = read_side_file(file);
  EXPECT_THAT(file.problems(), IsEmpty());
  ASSERT_EQ(side.organs.size(), 3u);
  EXPECT_THAT(side.organs[0].parts, ElementsAre("skin"));
  EXPECT_EQ(side.organs[0].role, "boundary");
  EXPECT_TRUE(side.organs[1].deformable);
  ASSERT_TRUE(side.scenario);
  EXPECT_EQ(side.scenario->wall.id, "abdominal_wall");
  ASSERT_EQ(side.scenario->wall.layers.size(), 3u);
  EXPECT_EQ(side.scenario->wall.layers[2].tissue, "muscle");
  EXPECT_EQ(side.scenario->needle, "18g_150mm");
  EXPECT_FALSE(side.scenario->contacts);
  EXPECT_FALSE(side.scenario->wall.box);
}

TEST(SideFile, NumbersBecomeMetres) {
  JsonFile file(
      "side.json",
      side_text(R"({"id": "liver", "deformable": true, "cell_mm": 8, "held_within_mm": 4})",
                R"({"name": "x", "wall": {"skin": "liver", "depth_mm": 30, "radius_mm": 70, "clearance_mm": 2,
                             "layers": [{"tissue": "fat", "thickness_mm": 9}, {"tissue": "muscle"}]},
                             "entry": [0.1, 0.2, 0.3], "target": "liver", "probe": {"at": [0, 0, 0]}})"));
  const SideFile side = read_side_file(file);
  EXPECT_THAT(file.problems(), IsEmpty());
  EXPECT_NEAR(side.organs[0].cell, 0.008, 1e-12);
  EXPECT_NEAR(side.organs[0].held_within, 0.004, 1e-12);
  EXPECT_NEAR(side.scenario->wall.depth, 0.030, 1e-12);
  EXPECT_NEAR(side.scenario->wall.radius, 0.070, 1e-12);
  EXPECT_NEAR(side.scenario->wall.clearance, 0.002, 1e-12);
  EXPECT_NEAR(side.scenario->wall.layers[0].thickness, 0.009, 1e-12);
  EXPECT_EQ(side.scenario->entry, Eigen::Vector3d(0.1, 0.2, 0.3));
}

/// A mistake, and what the one line about it must hold.
struct Mistake {
  const char* name;
  std::string text;
  std::string told;
};
class SideFileMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(SideFileMistake, IsReportedInOneLineWithItsPlace) {
  const std::vector<std::string> found = problems(GetParam().text);
  ASSERT_EQ(found.size(), 1u) << ::testing::PrintToString(found);
  EXPECT_THAT(found[0], HasSubstr("side.json:" + GetParam().told));
  EXPECT_EQ(found[0].find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    SideFile, SideFileMistake,
    ::testing::Values(
        Mistake{"NoOrgan", side_text(""), "/organs: is empty"},
        Mistake{"IdTwice", side_text(R"({"id": "a"}, {"id": "a"})"), "/organs/1/id: is used by an earlier organ"},
        Mistake{"IdWithSlash", side_text(R"({"id": "../a"})"), "/organs/0/id: is no id"},
        Mistake{"UnknownKey", side_text(R"({"id": "a", "tisue": "liver"})"), "/organs/0/tisue: "},
        Mistake{"UnknownRole", side_text(R"({"id": "a", "role": "organ"})"), "/organs/0/role: "},
        Mistake{"DeformableRegion", side_text(R"({"id": "a", "role": "region", "deformable": true})"),
                "/organs/0/role: of what is deformable"},
        Mistake{"WithinOfNothing", side_text(R"({"id": "a", "within_mm": 5})"), "/organs/0/within_mm: "},
        Mistake{"MeshOfTheRigid", side_text(R"({"id": "a", "cell_mm": 5})"),
                "/organs/0/cell_mm: is for what deforms"},
        Mistake{"NoSuchHolder", side_text(R"({"id": "a", "deformable": true, "held_by": ["b"]})"),
                "/organs/0/held_by/0: \"b\" is not an organ"},
        Mistake{"NoSuchBody",
                side_text(R"({"id": "skin"}, {"id": "liver", "deformable": true},
                                           {"id": "spot", "body": "livr"})",
                          scenario("")),
                "/organs/2/body: \"livr\" is not deformable of this file; did you mean \"liver\"?"},
        Mistake{"NoSuchTarget", side_text(R"({"id": "skin"}, {"id": "spots"})", scenario("")),
                "/scenario/target: \"spot\" is not an organ of this file; did you mean \"spots\"?"},
        Mistake{"LastLayerThick",
                side_text(kOrgans, scenario(R"(, "layers": [{"tissue": "fat", "thickness_mm": 3}])")),
                "/scenario/wall/layers/0: is the last"},
        Mistake{"LayersDeeperThanTheWall", side_text(kOrgans, scenario(R"(, "depth_mm": 9)")),
                "/scenario/wall: begins 10 mm below the skin"},
        Mistake{"BoxAndRadius",
                side_text(kOrgans, scenario(R"(, "box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "radius_mm": 50)")),
                "/scenario/wall/radius_mm: and box exclude each other"},
        Mistake{"BoxUpsideDown", side_text(kOrgans, scenario(R"(, "box": {"min": [0, 0, 0], "max": [1, -1, 1]})")),
                "/scenario/wall/box/max: "},
        Mistake{"WallNamedAsAnOrgan", side_text(kOrgans, scenario(R"(, "id": "spot")")),
                "/scenario/wall/id: is that of an organ"},
        Mistake{"ContactWithTheRigid",
                side_text(kOrgans, scenario("", R"(, "contacts": [{"nodes_of": "spot", "surface_of": "liver"}])")),
                "/scenario/contacts/0/nodes_of: \"spot\" is not deformable"},
        Mistake{"TooManyBodies",
                side_text(R"({"id": "skin"}, {"id": "spot"}, {"id": "b", "deformable": true},
                             {"id": "c", "deformable": true}, {"id": "d", "deformable": true},
                             {"id": "e", "deformable": true})",
                          scenario("")),
                "/organs: has 5 deformable"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(SideFile, ShippedOnesAreSound) {
  int checked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kShipped / "imports")) {
    if (entry.path().extension() != ".json") continue;
    JsonFile file(entry.path());
    EXPECT_TRUE(read_side_file(file).scenario);
    EXPECT_THAT(file.problems(), IsEmpty()) << entry.path();
    ++checked;
  }
  EXPECT_GE(checked, 1);
}

TEST(SideFile, SchemaAgreesWithTheReader) {
  // Every optional object there is; the values do not matter.
  readers::test::expect_schema_agrees(
      kShipped / "schemas" / "import.schema.json", kShipped / "imports" / "full.json",
      side_text(R"({"id": "a"})", R"({"wall": {"box": {}, "layers": [{}]}, "probe": {}, "contacts": [{}]})"), 8,
      [](JsonFile& file) { read_side_file(file); });
}

TEST(SideFile, SchemaAndReadmeAreMadeOfTheTableOfKeys) {
  readers::test::expect_generated(kShipped, side_file_format());
}

}  // namespace
}  // namespace stylet::import
