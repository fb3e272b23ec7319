// A scenario edited without a window.
#include "engine/author/draft.h"
#include "engine/author/json_edit.h"
#include "engine/author/picking.h"
#include "engine/content/probe_placement.h"
#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "tests/readers/small_scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <iterator>

namespace stylet::author {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(JsonEdit, ChangesAValueAndNoOtherByte) {
  const std::string text = "{ \"a\" :[1,  2.50], \"x\": {\"b\": \"}\\\"\", \"c\": null } }\n";
  EXPECT_EQ(with_value(text, {"a", "0"}, "7"), "{ \"a\" :[7,  2.50], \"x\": {\"b\": \"}\\\"\", \"c\": null } }\n");
  EXPECT_EQ(with_value(text, {"a", "1"}, "2.5"), text) << "the same, so it keeps its text";
  EXPECT_EQ(with_value(text, {"x", "c"}, "[3]"), "{ \"a\" :[1,  2.50], \"x\": {\"b\": \"}\\\"\", \"c\": [3] } }\n");
  EXPECT_EQ(with_value("{\n  \"a\": 1\n}\n", {"b"}, "2"), "{\n  \"a\": 1,\n  \"b\": 2\n}\n");
  EXPECT_EQ(with_value("{\"a\": []}", {"a", "0"}, "{}"), "{\"a\": [{}]}");
  EXPECT_EQ(without_value(text, {"x", "b"}), "{ \"a\" :[1,  2.50], \"x\": {\"c\": null } }\n");
  EXPECT_EQ(without_value("[1, 2, 3]", {"2"}), "[1, 2]");
  EXPECT_EQ(without_value(text, {"y"}), text);
  EXPECT_THROW(with_value(text, {"y", "z"}, "1"), files::ContentError);
  EXPECT_THROW(with_value("{", {"y"}, "1"), files::ContentError);
}

class Author : public ::testing::Test {
protected:
  Author() {
    files_.scenario["licence"] = "CC0-1.0";
    files_.write();
  }
  static void no_motion(const Eigen::Vector3d&, const std::filesystem::path& path) {
    std::ofstream(path) << "motion";
  }
  readers::test::SmallScenario files_;
};

TEST_F(Author, EveryChangeCanBeUndoneAndTheFileIsThenAsItWas) {
  files_.scenario["a_key_of_another_program"] = {{"kept", true}};
  files_.write();
  const std::string before = read_text(files_.path());
  Draft draft(files_.path());
  draft.set_target(0, {.name = "lesion", .centre = {0.1, 0.01, 0.02}, .radius = 0.0085});
  draft.set_probe({.position = {0.1, 0, 0.05}, .orientation = Eigen::Quaterniond(0, 1, 0, 0)});
  draft.set_camera({.eye = {0, 0, 2}, .look_at = {0, 0, 0}});
  draft.set_forbidden({"bone"});
  draft.set_entry({0.1, 0, 0.05});
  EXPECT_TRUE(draft.changed());
  const auto tree = nlohmann::json::parse(draft.text());
  EXPECT_EQ(tree["targets"][0],
            nlohmann::json::parse(R"({"name": "lesion", "centre": [0.1, 0.01, 0.02], "radius_mm": 8.5})"));
  EXPECT_FALSE(tree["probe"].contains("axis")) << "either axes or a quaternion";
  EXPECT_EQ(tree["a_key_of_another_program"]["kept"], true);
  const std::string all = draft.text();
  for (int i = 0; i < 5; ++i) draft.undo();
  EXPECT_EQ(draft.text(), before);
  EXPECT_FALSE(draft.changed() || draft.can_undo());
  for (int i = 0; i < 5; ++i) draft.redo();
  EXPECT_EQ(draft.text(), all);
  EXPECT_EQ(read_text(files_.path()), before) << "nothing is saved unasked";
}

TEST_F(Author, SavesWholeAndLeavesAnothersMotionAlone) {
  const std::string motion = read_text(files_.folder.path() / "motion.json");
  Draft draft(files_.path());
  draft.set_forbidden({"bone"});
  draft.set_entry({0.1, 0, 0.05});
  draft.save(no_motion);
  EXPECT_FALSE(draft.changed());
  EXPECT_EQ(read_text(files_.folder.path() / "motion.json"), motion);
  const auto tree = nlohmann::json::parse(read_text(files_.path()));
  EXPECT_EQ(tree["motion"], "scenario_motion.json");
  EXPECT_EQ(read_text(files_.folder.path() / "scenario_motion.json"), "motion");
}

TEST_F(Author, SavingAgainTakesThePlaceOfItsOwnMotionAndOfNoOther) {
  const auto count = [&] { return std::distance(std::filesystem::directory_iterator(files_.folder.path()), {}); };
  {
    Draft draft(files_.path());
    draft.set_entry({0.1, 0, 0.05});
    draft.save(no_motion);
    const auto files = count();
    const std::string saved = read_text(files_.path());
    draft.save([](const Eigen::Vector3d&, const std::filesystem::path&) { ADD_FAILURE() << "nothing has changed"; });
    EXPECT_EQ(read_text(files_.path()), saved);
    draft.set_forbidden({"bone"});
    draft.save(no_motion);
    draft.set_entry({0.1, 0.01, 0.05});
    draft.save(no_motion);
    EXPECT_EQ(count(), files);
  }
  const auto files = count();
  Draft later(files_.path());
  later.set_entry({0.1, 0.02, 0.05});
  later.save([](const Eigen::Vector3d&, const std::filesystem::path& path) { std::ofstream(path) << "later"; });
  EXPECT_EQ(count(), files);
  EXPECT_EQ(nlohmann::json::parse(read_text(files_.path()))["motion"], "scenario_motion.json");
  EXPECT_EQ(read_text(files_.folder.path() / "scenario_motion.json"), "later");
}

TEST_F(Author, AMotionThatCannotBeMadeLeavesEverythingAsItWas) {
  Draft draft(files_.path());
  draft.set_entry({0.1, 0, 0.05});
  const std::string before = read_text(files_.path());
  const auto files = std::distance(std::filesystem::directory_iterator(files_.folder.path()), {});
  EXPECT_THROW(draft.save([](const Eigen::Vector3d&, const std::filesystem::path& path) {
    std::ofstream(path) << "half";
    throw files::ContentError("no target");
  }),
               files::ContentError);
  EXPECT_EQ(read_text(files_.path()), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(files_.folder.path()), {}), files);
  EXPECT_TRUE(draft.changed());
}

TEST_F(Author, WhatAnotherProgramWroteMeanwhileIsNotWrittenOver) {
  Draft draft(files_.path());
  draft.set_forbidden({"bone"});
  std::ofstream(files_.path()) << "{}";
  EXPECT_THROW(draft.save(no_motion), files::ContentError);
  EXPECT_EQ(read_text(files_.path()), "{}");
  EXPECT_EQ(read_text(draft.keep()), draft.text()) << "and what was edited is not lost";
}

TEST_F(Author, WhatLiesUnderThePointer) {
  const content::Scene scene = readers::load_scene(files_.path());
  const Ray middle = ray_through(scene.camera, 320, 240, 640, 480);
  EXPECT_LT((middle.along - (scene.camera.look_at - scene.camera.eye).normalized()).norm(), 1e-12);
  // Through the centers of liver (50 mm), tumor and bone, from the front.
  const Ray ray{.from = {0.11, 0, 0.5}, .along = {0, 0, -1}};
  const std::vector<Chord> found = chords(scene, ray);
  ASSERT_GE(found.size(), 2u);
  EXPECT_EQ(scene.surfaces[found[0].surface].name, "liver_ball");
  EXPECT_NEAR(found[0].from, 0.5 - std::sqrt(0.05 * 0.05 - 0.01 * 0.01), 1e-3);
  EXPECT_EQ(scene.surfaces[found[1].surface].name, "tumour_ball");
  EXPECT_NEAR(0.5 * (found[1].from + found[1].to), 0.5, 1e-6) << "the middle of the organ that is meant";
  const auto skin = skin_under(scene.labels, {.from = {0.1, 0.02, 0.5}, .along = {0, 0, -1}});
  ASSERT_TRUE(skin);
  EXPECT_NEAR((skin->point - Eigen::Vector3d(0.1, 0, 0)).norm(), 0.05, 0.5 * scene.labels.spacing + 1e-3);
  EXPECT_GT(skin->normal.dot((skin->point - Eigen::Vector3d(0.1, 0, 0)).normalized()), 0.98);
  EXPECT_FALSE(skin_under(scene.labels, {.from = {0.5, 0, 0.5}, .along = {0, 0, -1}}));
  const std::size_t tumour = found[1].surface;
  const content::Target target = target_of(scene, {&tumour, 1});
  EXPECT_LT((target.centre - scene.targets[0].centre).norm(), 1e-6);
  EXPECT_NEAR(target.radius, scene.targets[0].radius, 1e-6);
}

TEST_F(Author, AProbePutOnTheSkinSeesTargetAndNeedle) {
  const content::Scene scene = readers::load_scene(files_.path());
  const auto skin = skin_under(scene.labels, {.from = {0.1, 0.02, 0.5}, .along = {0, 0, -1}});
  ASSERT_TRUE(skin);
  const Eigen::Vector3d target = scene.targets[0].centre, entry(0.06, 0, 0.03);
  const physics::RigidPose pose = content::probe_on_skin(skin->point, skin->normal, target, entry);
  for (const Eigen::Vector3d& point : {target, entry}) {
    EXPECT_NEAR((pose.orientation.conjugate() * (point - pose.position)).y(), 0, 1e-9) << "in the image's plane";
  }
  EXPECT_LT((pose.orientation.conjugate() * (entry - pose.position)).x(), 0) << "the needle comes from the left";
  content::Scene placed = scene;
  placed.probe.pose = pose;
  const std::vector<TargetPlan> targets{{.name = "tumour", .centre = target, .radius = 0.01}};
  EXPECT_TRUE(look_over(placed, targets, {}, entry).empty());
}

TEST_F(Author, OdditiesAreToldWhereTheyAre) {
  const content::Scene scene = readers::load_scene(files_.path());
  const std::vector<TargetPlan> beyond{{.name = "t", .centre = {0.1, 0, -0.085}, .radius = 0.01}};
  std::size_t bone = 0;
  while (scene.surfaces[bone].name != "bone_ball") ++bone;
  const std::vector<Oddity> odd = look_over(scene, beyond, {bone}, Eigen::Vector3d(0.1, 0.001, 0.05));
  std::vector<std::string> texts;
  for (const Oddity& each : odd) texts.push_back(each.text);
  EXPECT_THAT(texts, ::testing::Contains(HasSubstr("outside the patient")));
  EXPECT_THAT(texts, ::testing::Contains(HasSubstr("goes through bone_ball")));
  EXPECT_EQ(pointer_of("a/b.json:/targets/0/organ: there is no organ"), "/targets/0/organ");
  EXPECT_EQ(pointer_of("a/b.json: cannot be read"), "");
}

}  // namespace
}  // namespace stylet::author
