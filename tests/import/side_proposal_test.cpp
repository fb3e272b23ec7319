// A scenario from a label volume and the name of its target alone.
#include "engine/import/side_proposal.h"
#include "engine/files/error.h"
#include "engine/import/scene_import.h"
#include "engine/import/side_file.h"
#include "engine/mesh/solid.h"
#include "tests/mesh/shapes.h"
#include "tests/support/label_torso.h"
#include "tests/support/sanitized.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace stylet::import {
namespace {

using Eigen::Vector3d;
using files::ContentError;
using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;

const std::set<std::string> kTissueNames{"outside", "skin",      "fat",         "muscle",      "peritoneal_fat",
                                         "bone",    "cartilage", "liver",       "bowel",       "kidney_cortex",
                                         "bile",    "tumour",    "caval_blood", "portal_blood"};

std::vector<SourceFile> files_of(LabelImage image) {
  SourceFile file;
  file.path = "torso.nii";
  file.format = "NIfTI";
  for (const auto& [label, name] : image.names) file.parts.push_back({.name = name, .place = name, .label = label});
  file.image = std::move(image);
  std::vector<SourceFile> files;
  files.push_back(std::move(file));
  return files;
}

json organ(const json& side, const std::string& id) {
  for (const json& each : side["organs"]) {
    if (each["id"] == id) return each;
  }
  return {};
}

TEST(SideProposal, TakesPartsForWhatTheirNamesSay) {
  const auto files = files_of(support::torso_labels(0.006));
  const json side = json::parse(propose_side_text(files, "liver", "case1"));
  EXPECT_EQ(organ(side, "ribs")["parts"].size(), 4u);
  EXPECT_EQ(organ(side, "ribs")["tissue"], "bone");
  EXPECT_EQ(organ(side, "lungs")["tissue"], "outside");
  EXPECT_EQ(organ(side, "aorta")["role"], "vessel");
  EXPECT_EQ(organ(side, "gallbladder")["role"], "region");
  EXPECT_EQ(organ(side, "liver")["deformable"], true);
  EXPECT_EQ(organ(side, "lesion")["body"], "liver");
  EXPECT_EQ(organ(side, "lesion")["ball_mm"], 20);
  EXPECT_EQ(side["scenario"]["target"], "lesion");
  EXPECT_EQ(side["scenario"]["name"], "case1");
  EXPECT_FALSE(side["scenario"].contains("entry"));
  EXPECT_FALSE(side["scenario"]["wall"].contains("skin")) << "no label is the body";
  files::JsonFile file("side.json", side.dump());
  read_side_file(file);
  EXPECT_THAT(file.problems(), ::testing::IsEmpty());
}

TEST(SideProposal, ALesionLiesInTheOrganThatItTouches) {
  const auto files = files_of(support::torso_labels(0.003, 0.009));
  const json side = json::parse(propose_side_text(files, "liver_tum*", "case2"));
  EXPECT_EQ(organ(side, "liver_tumor")["role"], "target");
  EXPECT_EQ(organ(side, "liver_tumor")["body"], "liver");
  EXPECT_EQ(organ(side, "liver")["parts"], json({"liver", "liver_tumor"})) << "its labels leave the lesion out";
  EXPECT_TRUE(organ(side, "lesion").is_null()) << "nothing is made up";
}

TEST(SideProposal, ALesionAmongSurfacesLiesInTheOneRoundIt) {
  SourceFile file;
  file.path = "organs.glb";
  file.format = "glTF";
  // The middle of the lesion lies in the box of the kidney, which is smaller, but in the liver.
  const auto add = [&](const std::string& name, const Vector3d& centre, double radius) {
    file.parts.push_back({.name = name, .place = name, .mesh = mesh::test::icosphere(centre, radius, 3)});
  };
  add("body_skin", {0, 0, 0}, 0.2);
  add("liver", {-0.05, 0, 0}, 0.07);
  add("kidney_right", {-0.05, -0.055, -0.055}, 0.04);
  add("lesion_1", {-0.023, -0.028, -0.028}, 0.006);
  std::vector<SourceFile> files;
  files.push_back(std::move(file));
  const json side = json::parse(propose_side_text(files, "lesion_1", "case3"));
  EXPECT_EQ(organ(side, "lesion_1")["body"], "liver");
  EXPECT_EQ(side["scenario"]["wall"]["skin"], "body");
  EXPECT_EQ(organ(side, "body")["parts"], json({"body_skin"}));
  EXPECT_EQ(organ(side, "liver")["parts"], json({"liver"}));
}

/// Place in the list of organs: the later one counts.
std::ptrdiff_t place_of(const json& side, const std::string& id) {
  const json& organs = side["organs"];
  return std::ranges::find_if(organs, [&](const json& each) { return each["id"] == id; }) - organs.begin();
}

TEST(SideProposal, AnotherLesionIsSeenInTheOrganThatItLiesIn) {
  const auto labels = files_of(support::torso_labels(0.006, 0.012));
  const json of_labels = json::parse(propose_side_text(labels, "liver", "case4"));
  SourceFile file;
  file.path = "organs.glb";
  file.format = "glTF";
  const auto add = [&](const std::string& name, const Vector3d& centre, double radius) {
    file.parts.push_back({.name = name, .place = name, .mesh = mesh::test::icosphere(centre, radius, 3)});
  };
  add("liver_tumor", {-0.023, -0.028, -0.028}, 0.006);
  add("liver", {-0.05, 0, 0}, 0.07);
  add("body_skin", {0, 0, 0}, 0.2);
  std::vector<SourceFile> surfaces;
  surfaces.push_back(std::move(file));
  const json of_surfaces = json::parse(propose_side_text(surfaces, "liver", "case4"));
  for (const json& side : {of_labels, of_surfaces}) {
    EXPECT_EQ(organ(side, "liver_tumor")["role"], "region") << "it is not aimed at";
    EXPECT_EQ(organ(side, "liver_tumor")["body"], "liver") << "it moves with it";
    EXPECT_GT(place_of(side, "liver_tumor"), place_of(side, "liver")) << "or the liver would hide it";
    EXPECT_EQ(organ(side, "lesion")["role"], "target");
  }
  EXPECT_EQ(organ(of_labels, "liver")["parts"], json({"liver", "liver_tumor"})) << "its labels leave the lesion out";
  EXPECT_EQ(organ(of_surfaces, "liver")["parts"], json({"liver"}));
}

TEST(SideProposal, WhatLiesBehindThePeritoneumIsHeldBetter) {
  const auto files = files_of(support::torso_labels(0.006));
  const auto held = [&](const std::string& target) {
    return organ(json::parse(propose_side_text(files, target, "x")), target)["held_back_percent"].get<int>();
  };
  EXPECT_EQ(held("liver"), 30);
  EXPECT_EQ(held("kidney_right"), 50);
}

TEST(SideProposal, SaysWhatThereIsWhereNoPartOrSeveralAreCalledSo) {
  const auto files = files_of(support::torso_labels(0.006));
  const auto told = [&](const std::string& target) -> std::string {
    try {
      propose_side_text(files, target, "x");
    } catch (const ContentError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(told("livr"), HasSubstr("--target livr: no part is called so; there are vertebrae_L1, "));
  EXPECT_THAT(told("*"), HasSubstr("several parts are called so"));
}

struct Proposed {
  std::vector<SourceFile> files;
  ImportedScene scene;
};

const Proposed& proposed(double lesion) {
  static std::vector<std::pair<double, Proposed>> made;
  for (const auto& [radius, scene] : made) {
    if (radius == lesion) return scene;
  }
  Proposed result;
  result.files = files_of(support::torso_labels(support::kSanitized ? 0.006 : 0.003, lesion));
  files::JsonFile file("side.json", propose_side_text(result.files, lesion > 0 ? "liver_tumor" : "liver", "case"));
  const SideFile side = read_side_file(file);
  result.scene = import_scene(result.files, side, kTissueNames, {}, [](const std::string&, double) {});
  made.emplace_back(lesion, std::move(result));
  return made.back().second;
}

class ProposedScene : public ::testing::TestWithParam<double> {};

TEST_P(ProposedScene, NeedleAndProbeGoWhereACarefulHandPutsThem) {
  const ImportedScene& scene = proposed(GetParam()).scene;
  const auto organs = support::torso_organs();
  // The straight way, by the shapes that the labels were made of: clear of all but the liver.
  const Vector3d way = (scene.target - scene.entry).normalized();
  const double length = (scene.target - scene.entry).norm();
  double nearest_rib = 1;
  for (double s = 0; s < length; s += 5e-4) {
    const Vector3d x = scene.entry + s * way;
    for (const support::TorsoOrgan& organ : organs) {
      if (std::string(organ.name) == "liver") continue;
      EXPECT_FALSE(organ.holds(x)) << organ.name << " " << s * 1e3 << " mm below the skin";
      if (!std::string(organ.name).starts_with("rib")) continue;
      for (const double off : {0.001, 0.002, 0.003}) {
        for (const Vector3d& aside : {Vector3d(0, 1, 0), Vector3d(0, -1, 0)}) {
          if (organ.holds(x + off * aside)) nearest_rib = std::min(nearest_rib, off);
        }
      }
    }
  }
  EXPECT_GT(nearest_rib, 0.0015);
  EXPECT_LT(length, 0.11) << "within a needle's reach";
  EXPECT_GT(scene.outward.z(), -0.3) << "the patient lies on the back";
  EXPECT_GT(-way.dot(scene.outward), 0.5) << "not along the skin";
  const double beside = (scene.probe.position - scene.entry).norm();
  EXPECT_GT(beside, 0.035);
  EXPECT_LT(beside, 0.070);
  const Vector3d seen = scene.probe.orientation.conjugate() * (scene.target - scene.probe.position);
  EXPECT_NEAR(seen.y(), 0, 1e-6) << "the target is in the image";
  const Vector3d from = scene.probe.orientation.conjugate() * (scene.entry - scene.probe.position);
  EXPECT_NEAR(from.y(), 0, 1e-6) << "so is the needle";
  // The beam comes from the middle of the circle that the face of the convex probe is a part of.
  const Vector3d beam = seen + Vector3d(0, 0, content::Probe{}.radius);
  const double to_beam = std::acos(beam.normalized().dot((seen - from).normalized())) * 180 / std::numbers::pi;
  EXPECT_GE(to_beam, 40) << "a needle along the beam is not in the image";
  EXPECT_LE(to_beam, 90);
  EXPECT_LT(std::abs(std::atan2(seen.x(), seen.z())), 0.4);
  EXPECT_TRUE(organs[2].holds(scene.target)) << "in the liver";
  EXPECT_THAT(scene.warnings, Contains(HasSubstr("derived: no part is the body")));
  EXPECT_THAT(scene.warnings, ::testing::Not(Contains(HasSubstr("the straight way to the target passes"))));
}

TEST_P(ProposedScene, SkinIsWholeAndTheWallLiesAboutTheEntry) {
  const ImportedScene& scene = proposed(GetParam()).scene;
  const auto named = [&](const std::string& name) {
    return std::ranges::find(scene.surfaces, name, &gltf::AnnotatedSurface::name);
  };
  ASSERT_NE(named("abdominal_wall"), scene.surfaces.end());
  ASSERT_NE(named("body_outside_field"), scene.surfaces.end());
  // Every place on the body's skin has skin: of the wall, or outside its field.
  const mesh::Solid body(named("body")->mesh);
  const mesh::Solid wall(named("abdominal_wall")->mesh), rest(named("body_outside_field")->mesh);
  double farthest = 0;
  for (const Vector3d& v : body.surface().vertices) {
    farthest = std::max(farthest, std::min(wall.nearest(v).distance, rest.nearest(v).distance));
  }
  EXPECT_LT(farthest, 0.004);
  EXPECT_LT(wall.nearest(scene.entry).distance, 0.002);
  EXPECT_LT(wall.nearest(scene.probe.position).distance, 0.002);
}

INSTANTIATE_TEST_SUITE_P(Lesion, ProposedScene, ::testing::Values(0.0, 0.010),
                         [](const auto& info) { return info.param > 0 ? "Segmented" : "MadeUp"; });

TEST(MadeUpLesion, KeepsOffWhatIsAboutIt) {
  const ImportedScene& scene = proposed(0).scene;
  const auto lesion = std::ranges::find(scene.surfaces, "lesion", &gltf::AnnotatedSurface::name);
  ASSERT_NE(lesion, scene.surfaces.end());
  EXPECT_EQ(lesion->body, "liver");
  const auto organs = support::torso_organs();
  for (const Vector3d& v : lesion->mesh.vertices) {
    EXPECT_NEAR((v - scene.target).norm(), 0.010, 0.0008);
    EXPECT_TRUE(organs[2].holds(v));
    for (std::size_t other = 3; other < organs.size(); ++other) EXPECT_FALSE(organs[other].holds(v));
  }
  EXPECT_THAT(scene.warnings, Contains(HasSubstr("lesion is made up: a ball of 20 mm in liver")));
}

}  // namespace
}  // namespace stylet::import
