// A whole scenario from a side file: a torso of spheres, whose every distance is known.
#include "engine/import/scene_import.h"
#include "engine/content/probe_placement.h"
#include "engine/files/error.h"
#include "engine/import/scenario_folder.h"
#include "engine/import/scene_files.h"
#include "engine/import/scene_survey.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/readers/scenario.h"
#include "tests/mesh/shapes.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace stylet::import {
namespace {

using files::ContentError;
using mesh::TriangleMesh;
using mesh::test::icosphere;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ImportProgress kQuiet = [](const std::string&, double) {};
const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";
const std::set<std::string> kTissues{"outside", "skin", "fat", "muscle", "liver", "bone", "tumour", "caval_blood"};

constexpr double kBodyRadius = 0.12;        // m, about the origin
constexpr double kCutAt = 0.06;             // m: the scan ends at y = 60 mm
const Eigen::Vector3d kLiver(-0.05, 0, 0);  // centre
constexpr double kLiverRadius = 0.045;
const Eigen::Vector3d kLesion(-0.06, 0.002, 0.004);
constexpr int kLevel = support::kSanitized ? 3 : 5;

SourcePart part(const std::string& name, TriangleMesh mesh) {
  return {.name = name, .place = "torso.glb:/" + name, .mesh = std::move(mesh), .organ = {}, .tissue = {}};
}

/// A ball of a body, flat where the scan ends; a liver ball with a lesion; three pieces of a rib in the wall; a
/// vessel that runs from inside the liver to the left.
std::vector<SourceFile> torso() {
  TriangleMesh body = icosphere({0, 0, 0}, kBodyRadius, kLevel);
  for (Eigen::Vector3d& v : body.vertices) v.y() = std::min(v.y(), kCutAt);
  TriangleMesh vessel = icosphere({0, 0, 0}, 1, 3);
  for (Eigen::Vector3d& v : vessel.vertices) v = v.cwiseProduct(Eigen::Vector3d(0.05, 0.008, 0.008));
  SourceFile file{.path = "torso.glb", .format = "glTF", .parts = {}, .image = {}, .assumptions = {}, .warnings = {}};
  file.parts.push_back(part("Body", body));
  file.parts.push_back(part("Liver", icosphere(kLiver, kLiverRadius, 4)));
  file.parts.push_back(part("Lesion 1", icosphere(kLesion, 0.01, 3)));
  file.parts.push_back(part("vein", vessel));
  file.parts.push_back(part("spine", icosphere({-0.03, -0.02, -0.045}, 0.012, 3)));
  file.parts.push_back(part("spare", icosphere({0.08, 0, 0}, 0.005, 2)));
  SourceFile other = file;
  other.path = "ribs.glb";
  other.parts.clear();
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.7 + 0.12 * i;
    other.parts.push_back(
        part("rib_" + std::to_string(i),
             icosphere(0.105 * Eigen::Vector3d(std::cos(angle), -0.35, std::sin(angle)), 0.004, 2)));
  }
  return {file, other};
}

const char* kSide = R"({"format": "stylet-import", "version": 1, "organs": [
    {"id": "body", "parts": ["Body"]},
    {"id": "ribs", "parts": ["rib_*"], "tissue": "bone"},
    {"id": "spine", "tissue": "bone"},
    {"id": "liver", "deformable": true, "target_nodes": 600, "held_by": ["spine"], "held_within_mm": 9},
    {"id": "vein", "role": "vessel", "tissue": "caval_blood", "body": "liver", "within_mm": 4},
    {"id": "lesion", "parts": ["lesion*"], "role": "target", "tissue": "tumour", "body": "liver"}],
  "scenario": {"name": "torso", "entry": [-0.121, 0, 0.004], "target": "lesion", "probe": {"at": [-0.1, 0, 0.066]},
    "wall": {"skin": "body", "depth_mm": 18, "radius_mm": 95, "target_nodes": 900, "held_by": ["ribs"],
             "filler": "fat", "clearance_mm": 1.5}}})";

SideFile side_file(const std::string& text) {
  files::JsonFile file("side.json", text);
  SideFile side = read_side_file(file);
  EXPECT_THAT(file.problems(), IsEmpty());
  return side;
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

constexpr double kFieldRadius = support::kSanitized ? 0.035 : 0.095;  // m

/// Under a sanitizer the wall is a small one.
const ImportedScene& torso_scene() {
  static const ImportedScene scene = import_scene(
      torso(), side_file(support::kSanitized ? replaced(kSide, "\"radius_mm\": 95", "\"radius_mm\": 35") : kSide),
      kTissues, {}, kQuiet);
  return scene;
}

const gltf::AnnotatedSurface& surface(const ImportedScene& scene, const std::string& name) {
  for (const gltf::AnnotatedSurface& each : scene.surfaces) {
    if (each.name == name) return each;
  }
  ADD_FAILURE() << "no surface " << name;
  return scene.surfaces.front();
}

TEST(ImportScene, FindsWhereTheScanEnds) {
  const ImportedScene& scene = torso_scene();
  ASSERT_EQ(scene.cuts.size(), 1u);
  EXPECT_EQ(scene.cuts[0].name(), "the head");
  EXPECT_NEAR(scene.cuts[0].at, kCutAt, 1e-9);
  // The body is closed, so what faces the head on the cut is what faces the feet everywhere, less what faces the head
  // elsewhere.
  const TriangleMesh body = torso()[0].parts[0].mesh;
  double area = 0;
  for (const auto& [a, b, c] : body.triangles) {
    const auto& v = body.vertices;
    if (v[a].y() == kCutAt && v[b].y() == kCutAt && v[c].y() == kCutAt) continue;
    area -= 0.5 * (v[b] - v[a]).cross(v[c] - v[a]).y();
  }
  EXPECT_NEAR(scene.cuts[0].area, area, 0.01 * area);  // a triangle that is nearly on the cut counts too
  if (!support::kSanitized) {                          // there the sphere is a coarse one
    const double disc = std::numbers::pi * (kBodyRadius * kBodyRadius - kCutAt * kCutAt);
    EXPECT_NEAR(scene.cuts[0].area, disc, 0.05 * disc);
  }
  for (const SceneOrgan& organ : scene.organs) {
    if (organ.id == "body") {
      EXPECT_THAT(organ.notes, ::testing::Contains(HasSubstr("towards the head")));
    }
  }
}

// A core that the target does not hold would have to miss a part of it, however well one aims.
TEST(ScenarioJson, ProposesTheLongCoreWhereTheTargetHoldsIt) {
  for (const auto& [radius, throw_mm] : {std::pair(0.010, 22), std::pair(0.006, 11)}) {
    ImportedScene scene;
    scene.entry = {0, 0, 0.1};
    scene.path = {{"liver", 0.03, 0.1}, {"lesion", 0.1 - radius, 0.1}};
    SideFile side;
    side.scenario.emplace();
    const auto json = nlohmann::json::parse(scenario_json(scene, side));
    EXPECT_EQ(json["sampling"]["throw_mm"], throw_mm);
    EXPECT_THAT(json["briefing"]["steps"].back().get<std::string>(), HasSubstr(fmt::format("{} mm", throw_mm)));
    EXPECT_LE(throw_mm - 5, 2e3 * radius) << "the core is as long as the throw less 5 mm";
  }
}

TEST(ImportScene, WallLiesWithinItsDepthOfTheSkinAndClearOfTheOrgans) {
  const TriangleMesh& wall = surface(torso_scene(), "abdominal_wall").mesh;
  const mesh::SurfaceReport report = mesh::inspect(wall);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
  constexpr double kSag = support::kSanitized ? 3e-3 : 0.8e-3;  // of the triangles of body and wall, m
  double deepest = 0;
  for (const Eigen::Vector3d& v : wall.vertices) {
    const double depth = kBodyRadius - v.norm();
    deepest = std::max(deepest, depth);
    EXPECT_GT(depth, -kSag);
    EXPECT_LT(depth, 0.018 + kSag);
    EXPECT_LT((v - torso_scene().entry).norm(), kFieldRadius + kSag);
    EXPECT_LT(v.y(), kCutAt - 2e-3) << "ends short of the cut";
    EXPECT_GT((v - kLiver).norm(), kLiverRadius + 0.0015 - kSag) << "clear of the liver";
  }
  EXPECT_GT(deepest, 0.018 - kSag);
  // Nested layers: what is deeper than 2 and than 10 mm.
  for (const auto& [name, from] :
       {std::pair{"abdominal_wall_fat", 0.002}, std::pair{"abdominal_wall_muscle", 0.010}}) {
    double shallowest = 1;
    for (const Eigen::Vector3d& v : surface(torso_scene(), name).mesh.vertices) {
      shallowest = std::min(shallowest, kBodyRadius - v.norm());
    }
    EXPECT_NEAR(shallowest, from, kSag) << name;
  }
  EXPECT_EQ(surface(torso_scene(), "abdominal_wall").tissue, "skin");
}

TEST(ImportScene, WhatSticksOutOfItsBodyIsParted) {
  const TriangleMesh& near = surface(torso_scene(), "vein").mesh;
  const TriangleMesh& rest = surface(torso_scene(), "vein_rest").mesh;
  EXPECT_EQ(surface(torso_scene(), "vein").body, "liver");
  EXPECT_EQ(surface(torso_scene(), "vein_rest").body, "");
  double farthest = 0, nearest = 1;
  for (const Eigen::Vector3d& v : near.vertices) farthest = std::max(farthest, (v - kLiver).norm() - kLiverRadius);
  for (const Eigen::Vector3d& v : rest.vertices) nearest = std::min(nearest, (v - kLiver).norm() - kLiverRadius);
  EXPECT_NEAR(farthest, 0.004, 0.7e-3);
  EXPECT_NEAR(nearest, 0.004, 0.7e-3);
  const double whole = 4.0 / 3 * std::numbers::pi * 0.05 * 0.008 * 0.008;
  EXPECT_NEAR(mesh::inspect(near).volume + mesh::inspect(rest).volume, whole, 0.06 * whole);
}

TEST(ImportScene, PiecesOfSeveralFilesAreOneOrgan) {
  const auto& organs = torso_scene().organs;
  const auto ribs = std::find_if(organs.begin(), organs.end(), [](const auto& organ) { return organ.id == "ribs"; });
  ASSERT_NE(ribs, organs.end());
  EXPECT_EQ(ribs->pieces, 3);
  EXPECT_EQ(ribs->parts.size(), 3u);
  EXPECT_THAT(torso_scene().left_out, ::testing::ElementsAre("spare"));
}

TEST(ImportScene, NeedleAndProbeLieInOnePlaneOnTheSkin) {
  const ImportedScene& scene = torso_scene();
  EXPECT_NEAR(scene.entry.norm(), kBodyRadius, 1e-3);
  EXPECT_NEAR(scene.probe.position.norm(), kBodyRadius, 1e-3);
  EXPECT_LT((scene.target - kLesion).norm(), 1e-4);
  const Eigen::Vector3d across = scene.probe.orientation * Eigen::Vector3d::UnitY();
  EXPECT_LT(std::abs(across.dot(scene.entry - scene.probe.position)), 1e-6);
  EXPECT_LT(std::abs(across.dot(scene.target - scene.probe.position)), 1e-6);
  const Eigen::Vector3d right = scene.probe.orientation * Eigen::Vector3d::UnitX();
  EXPECT_LT(right.dot(scene.entry - scene.probe.position), 0) << "the needle comes from the left";
}

TEST(ImportScene, ReportsTheTissuesOnTheNeedlesPath) {
  const std::vector<PathPiece>& path = torso_scene().path;
  std::vector<std::string> names;
  names.reserve(path.size());
  for (const PathPiece& piece : path) names.push_back(piece.organ);
  EXPECT_THAT(names, ::testing::ElementsAre("abdominal_wall", "abdominal_wall_fat", "abdominal_wall_muscle", "liver",
                                            "lesion"));
  EXPECT_THAT(torso_scene().warnings, IsEmpty());
  if (support::kSanitized) return;
  // An entry below the middle rib: the way leads through it.
  const std::string aside = replaced(kSide, "[-0.121, 0, 0.004]", "[-0.108, -0.04, 0.036]");
  const ImportedScene scene = import_scene(torso(), side_file(aside), kTissues, {}, kQuiet);
  EXPECT_THAT(scene.warnings, ::testing::Contains(HasSubstr("passes ribs (bone)")));
}

TEST(ImportScene, WhatDeformsIsOnePiece) {
  if (support::kSanitized) GTEST_SKIP() << "as the others";
  std::vector<SourceFile> files = torso();
  SourcePart& liver = files.front().parts[1];
  mesh::append(liver.mesh, icosphere(kLiver - Eigen::Vector3d(0, 0.06, 0), 0.004, 2));  // a speck of a segmentation
  const ImportedScene scene = import_scene(files, side_file(kSide), kTissues, {}, kQuiet);
  const mesh::SurfaceReport report = mesh::inspect(surface(scene, "liver").mesh);
  EXPECT_EQ(report.components, 1);
  EXPECT_NEAR(report.volume, mesh::inspect(surface(torso_scene(), "liver").mesh).volume, 1e-9) << "and the liver";
  const auto account = std::ranges::find(scene.organs, "liver", &SceneOrgan::id);
  ASSERT_NE(account, scene.organs.end());
  EXPECT_THAT(account->notes, ::testing::Contains(HasSubstr("1 smaller piece(s) left out")));
}

TEST(ImportScene, SaysThatNoProbeSeesTheNeedleWell) {
  if (support::kSanitized) GTEST_SKIP() << "a wall as wide as the probe needs";
  // From the far side of the body: so deep, a needle beside the probe goes nearly along its beams.
  const std::string far = replaced(replaced(kSide, "[-0.121, 0, 0.004]", "[0.121, 0, 0.004]"),
                                   R"(, "probe": {"at": [-0.1, 0, 0.066]})", "");
  const ImportedScene scene = import_scene(torso(), side_file(far), kTissues, {}, kQuiet);
  content::Probe held;
  held.pose = scene.probe;
  const double angle =
      content::angle_to_beam(held, scene.target, scene.target - scene.entry) * 180 / std::numbers::pi;
  EXPECT_LT(angle, 40);
  EXPECT_GT(angle, 15) << "the best that there is";
  EXPECT_THAT(scene.warnings,
              ::testing::Contains(HasSubstr(fmt::format("makes {:.0f} degrees with the ultrasound's beam", angle))));
}

TEST(Overlaps, AreMeasuredAndTheLaterCounts) {
  const double r = 0.03, d = 0.04;  // two balls whose centres are d apart
  const std::vector<gltf::AnnotatedSurface> balls{
      {.name = "a", .role = "boundary", .tissue = "liver", .body = {}, .mesh = icosphere({0, 0, 0}, r, 4)},
      {.name = "b", .role = "boundary", .tissue = "liver", .body = {}, .mesh = icosphere({d, 0, 0}, r, 4)}};
  const std::vector<Overlap> overlaps = find_overlaps(balls);
  ASSERT_EQ(overlaps.size(), 1u);
  EXPECT_EQ(overlaps[0].gives_way, "a");
  EXPECT_EQ(overlaps[0].counts, "b");
  const double lens = std::numbers::pi / 12 * (4 * r + d) * (2 * r - d) * (2 * r - d);
  EXPECT_NEAR(overlaps[0].volume, lens, 0.03 * lens);
  EXPECT_NEAR(overlaps[0].share, lens / (4.0 / 3 * std::numbers::pi * r * r * r), 0.01);
}

/// A hand that does nothing: enough to load.
content::Motion still(const ImportedScene& scene, const content::Needle& needle) {
  content::Motion motion;
  for (int i = 0; i < 2; ++i) {
    content::MotionSample sample;
    sample.time_s = i;
    sample.pose.position = scene.entry + (needle.length + 0.02) * scene.outward;
    motion.stylus.push_back(sample);
  }
  return motion;
}

std::string bytes_of(const std::filesystem::path& path) {
  return files::read_file(path, 64u << 20);
}

TEST(WriteScenario, LeavesASoundFolderOfTheSameBytesEachTime) {
  if (support::kSanitized) GTEST_SKIP() << "a minute and more with a sanitizer; the steps are tested above";
  const support::TemporaryFolder folder;
  const std::string coarse =
      replaced(kSide, "\"target\": \"lesion\"", "\"target\": \"lesion\", \"label_spacing_mm\": 3");
  const SideFile side = side_file(coarse);
  const ScenarioFolder written = write_scenario(torso(), side, folder / "a", kContent, "test", still, kQuiet);
  EXPECT_THAT(readers::validate(folder / "a/scenario.json"), IsEmpty());
  const nlohmann::json scenario = nlohmann::json::parse(bytes_of(folder / "a/scenario.json"));
  EXPECT_EQ(scenario["sampling"]["kind"], "biopsy") << "proposed, as scoring, briefing and hints are";
  EXPECT_EQ(scenario["scoring"][0]["metric"], "tumour_content");
  EXPECT_THAT(scenario["briefing"]["goal"].get<std::string>(), HasSubstr("lesion"));
  EXPECT_FALSE(scenario["hints"].empty());
  ASSERT_EQ(written.bodies.size(), 2u);
  for (const BodyAccount& body : written.bodies) {
    std::printf("  %s: %zu nodes, %.2f %%, %.1f degrees\n", body.name.c_str(), body.nodes,
                100 * (body.volume / body.surface_volume - 1), body.min_dihedral_deg);
    EXPECT_EQ(body.inverted, 0);
    EXPECT_GE(body.min_dihedral_deg, 12);
    EXPECT_NEAR(body.volume / body.surface_volume, 1, 0.04) << body.name << ", of few nodes";
    EXPECT_GE(body.held, 10u) << body.name;
    EXPECT_LT(body.held, 3 * body.nodes / 4) << body.name;
  }
  const nlohmann::json report = nlohmann::json::parse(bytes_of(folder / "a/report.json"));
  EXPECT_EQ(report["scan_cuts"].size(), 1u);
  EXPECT_EQ(report["bodies"].size(), 2u);
  EXPECT_THAT(bytes_of(folder / "a/report.txt"), HasSubstr("ends towards the head at y = 60.0 mm"));
  write_scenario(torso(), side, folder / "b", kContent, "test", still, kQuiet);
  for (const char* name : {"scenario.json", "organs.glb", "motion.json", "report.json", "report.txt", "picture.png",
                           "tissues.json", "needle.json", "probe.json"}) {
    EXPECT_EQ(bytes_of(folder / "a" / name), bytes_of(folder / "b" / name)) << name;
  }
}

/// A side file that cannot be followed, and what the one line about it must hold.
// Nothing of the folder is there: what is wrong with a file of it is told of the side file.
TEST(WriteScenario, WhatCannotBeTrainedIsToldOfTheSideFile) {
  const support::TemporaryFolder folder;
  const SideFile side = side_file(replaced(kSide, "\"held_within_mm\": 9", "\"held_within_mm\": 0.01"));
  try {
    write_scenario(torso(), side, folder / "out", kContent, "test", still, kQuiet);
    ADD_FAILURE() << "was followed";
  } catch (const ContentError& error) {
    EXPECT_THAT(error.what(),
                testing::StartsWith("side.json:/scenario: what it makes cannot be trained: scenario.json:/"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr(folder.path().string()))) << "cites what is not there";
  }
  EXPECT_TRUE(folder.empty());
}

struct Refusal {
  const char* name;
  const char* what;
  const char* with;
  const char* told;
  bool after_the_wall = false;
};
class SideFileRefusal : public ::testing::TestWithParam<Refusal> {};

TEST_P(SideFileRefusal, SaysWhereAndLeavesNothing) {
  const Refusal& refusal = GetParam();
  if (support::kSanitized && refusal.after_the_wall) GTEST_SKIP() << "a minute and more with a sanitizer";
  const support::TemporaryFolder folder;
  const SideFile side = side_file(replaced(kSide, refusal.what, refusal.with));
  try {
    write_scenario(torso(), side, folder / "out", kContent, "test", still, kQuiet);
    ADD_FAILURE() << "was followed";
  } catch (const ContentError& error) {
    EXPECT_THAT(error.what(), HasSubstr(refusal.told));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  EXPECT_TRUE(folder.empty());
}

INSTANTIATE_TEST_SUITE_P(
    WriteScenario, SideFileRefusal,
    ::testing::Values(
        Refusal{"NoSuchPart", "\"lesion*\"", "\"tumor*\"",
                "side.json:/organs/5/parts: organ lesion: no part is called"},
        Refusal{"PartTwice", "\"rib_*\"", "\"rib_*\", \"liver\"", "side.json:/organs/3/parts: \"Liver\" belongs to"},
        Refusal{"NoSuchTissue", "\"tissue\": \"bone\"", "\"tissue\": \"bones\"",
                "side.json:/organs/1/tissue: the tissue table has no \"bones\"; did you mean \"bone\"?"},
        Refusal{"NoTissueAtAll", "\"tissue\": \"bone\"", "\"priority\": 0",
                "side.json:/organs/1/tissue: the tissue table has no \"ribs\""},
        Refusal{"EntryOffTheSkin", "[-0.121, 0, 0.004]", "[-0.160, 0, 0.004]",
                "side.json:/scenario/entry: lies 40 mm from the skin; the nearest point on it is [-0.1"},
        Refusal{"ProbeOffTheSkin", "[-0.1, 0, 0.066]", "[-0.07, 0, 0.046]",
                "side.json:/scenario/probe/at: lies 36 mm"},
        Refusal{"ProbeAtTheEntry", "[-0.1, 0, 0.066]", "[-0.121, 0, 0.004]", "looks along the needle"},
        Refusal{"NoSuchNeedle",
                "\"target\":", "\"needle\": \"19g\", \"target\":", "side.json:/scenario/needle: there is neither"},
        Refusal{"NothingHoldsIt", "\"held_by\": [\"spine\"], \"held_within_mm\": 9", "\"priority\": 0",
                "side.json:/organs/3: nothing holds liver", true},
        Refusal{"NothingNearItsBody", "\"vessel\", \"tissue\": \"caval_blood\", \"body\": \"liver\"",
                "\"vessel\", \"tissue\": \"caval_blood\", \"body\": \"abdominal_wall\"",
                "nothing of vein lies within", true}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace stylet::import
