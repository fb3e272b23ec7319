// What the project ships: it loads, it is what it says, and schemas, readers and files agree.
#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "engine/mesh/solid.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/device_profile_file.h"
#include "engine/readers/formats.h"
#include "engine/readers/instruments.h"
#include "engine/readers/motion.h"
#include "engine/readers/motion_file.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario.h"
#include "engine/readers/scenario_file.h"
#include "tests/gltf/glb.h"
#include "tests/readers/generated_files.h"
#include "tests/readers/schema_agreement.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <functional>
#include <set>

namespace stylet::readers {
namespace {

using ::testing::IsEmpty;
using json = nlohmann::json;

const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";

const std::filesystem::path kDefaultScenario = kContent / "scenarios" / "liver_biopsy.json";

const content::Scene& default_scene() {
  static const content::Scene scene = load_scene(kDefaultScenario);
  return scene;
}

/// The default scene for claims that hold on every mesh: under a sanitizer with few nodes and coarse labels.
const content::Scene& default_scene_of_any_mesh() {
  if (!support::kSanitized) return default_scene();
  static const content::Scene scene = [] {
    const files::JsonFile shipped(kDefaultScenario);
    json scenario = shipped.tree();
    const auto absolute = [](json& path) {
      path = std::filesystem::weakly_canonical(kDefaultScenario.parent_path() / path.get<std::string>()).string();
    };
    for (const char* key : {"tissues", "needle", "motion"}) absolute(scenario[key]);
    absolute(scenario["probe"]["file"]);
    absolute(scenario["organs"][0]["file"]);
    for (json& body : scenario["bodies"]) body["mesh"] = {{"target_nodes", 300}};
    scenario["labels"]["spacing_mm"] = 4;
    const support::TemporaryFolder folder;
    return load_scene(folder.write("scenario.json", scenario.dump(1)));
  }();
  return scene;
}

/// The scenario as written, for claims about what it names.
ScenarioFile default_scenario_file() {
  files::JsonFile file(kDefaultScenario);
  return read_scenario_file(file);
}

content::Motion default_motion() {
  return read_motion(default_scenario_file().motion);
}

content::Needle default_needle() {
  files::JsonFile file(default_scenario_file().needle);
  return read_needle(file);
}

TEST(ShippedContent, EveryFileIsSound) {
  int checked = 0;
  for (const char* folder : {"needles", "probes", "motions", "scenarios"}) {
    for (const auto& entry : std::filesystem::directory_iterator(kContent / folder)) {
      if (entry.path().extension() != ".json") continue;
      // The patient of liver_biopsy again, half a minute each.
      const std::string name = entry.path().stem();
      if (support::kSanitized && (name == "rfa" || name == "liver_biopsy_fine")) continue;
      EXPECT_THAT(validate(entry.path()), IsEmpty()) << entry.path();
      ++checked;
    }
  }
  EXPECT_THAT(validate(kContent / "tissues.json"), IsEmpty());
  EXPECT_THAT(validate(kContent / "phantom_tissues.json"), IsEmpty());
  EXPECT_GE(checked, 4);
}

TEST(ShippedContent, TheFineBiopsyIsTheBiopsyInSmallTetrahedra) {
  nlohmann::json biopsy = files::JsonFile(kDefaultScenario).tree();
  nlohmann::json fine = files::JsonFile(kContent / "scenarios" / "liver_biopsy_fine.json").tree();
  int nodes = 0;
  for (nlohmann::json& body : fine["bodies"]) nodes += body["mesh"]["target_nodes"].get<int>();
  EXPECT_GE(3 * nodes, 100'000);
  for (nlohmann::json* scenario : {&biopsy, &fine}) {
    scenario->erase("name");
    scenario->erase("title");
    for (nlohmann::json& body : (*scenario)["bodies"]) body.erase("mesh");
  }
  EXPECT_EQ(fine, biopsy);
}

TEST(ShippedContent, EveryFolderStatesALicence) {
  for (const auto& entry : std::filesystem::directory_iterator(kContent)) {
    if (!entry.is_directory()) continue;
    const bool licence = std::filesystem::exists(entry.path() / "LICENCE.md");
    EXPECT_TRUE(licence || std::filesystem::exists(entry.path() / "README.md")) << entry.path();
  }
}

TEST(ShippedContent, DefaultSceneHasTheAnatomyOfABiopsy) {
  const content::Scene& scene = default_scene();
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[2].name, "kidney");
  EXPECT_EQ(scene.probe.presses, 0);
  EXPECT_EQ(scene.contacts.size(), 2u);
  // Breathing takes the liver along by what a diaphragm moves; the wall rises a little.
  ASSERT_EQ(scene.bodies[1].held_motion.size(), scene.bodies[1].fixed_nodes.size());
  for (const Eigen::Vector3d& motion : scene.bodies[1].held_motion) {
    EXPECT_GE(motion.norm(), 0.010);
    EXPECT_LE(motion.norm(), 0.020);
  }
  double largest = 0;
  for (const Eigen::Vector3d& motion : scene.bodies[0].held_motion) {
    EXPECT_EQ(motion.head<2>().norm(), 0) << "the wall rises";
    largest = std::max(largest, motion.z());
  }
  EXPECT_GE(largest, 0.002);
  EXPECT_LE(largest, 0.005);
  const content::DeformableBody& liver = scene.bodies[1];
  EXPECT_EQ(liver.name, "liver");
  EXPECT_GE(liver.mesh.nodes.size(), 2000u);
  double volume = 0;
  for (const auto& tet : liver.mesh.tets) {
    const auto x = [&](std::size_t i) { return liver.mesh.nodes[tet[i]]; };
    const double v = (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) / 6;
    ASSERT_GT(v, 0);
    volume += v;
  }
  EXPECT_GT(volume, 1.1e-3);
  EXPECT_LT(volume, 1.9e-3);
  // The layers of the wall and the tumour reach the mechanics.
  const auto has_tissue = [&](const content::DeformableBody& body, const char* name) {
    return std::count(body.tet_tissue.begin(), body.tet_tissue.end(), content::find_tissue(scene.tissues, name)) > 10;
  };
  for (const char* name : {"skin", "fat", "muscle"}) EXPECT_TRUE(has_tissue(scene.bodies[0], name)) << name;
  EXPECT_TRUE(has_tissue(liver, "tumour"));
  // Mechanics by volume: somewhere between the softest and the stiffest that lie in a body; layers thinner than a
  // tetrahedron count with their share.
  const double stiffest = scene.tissues[content::find_tissue(scene.tissues, "skin")].mechanics.young_modulus;
  for (const content::DeformableBody& body : scene.bodies) {
    ASSERT_EQ(body.tet_mechanics.size(), body.mesh.tets.size());
    int mixed = 0;
    for (std::size_t t = 0; t < body.tet_mechanics.size(); ++t) {
      const double young = body.tet_mechanics[t].young_modulus;
      EXPECT_GE(young, 999);
      EXPECT_LE(young, stiffest * (1 + 1e-12));
      if (young != scene.tissues[body.tet_tissue[t]].mechanics.young_modulus) ++mixed;
    }
    EXPECT_GT(mixed, 50) << body.name;
    EXPECT_LT(mixed, static_cast<int>(body.tet_mechanics.size())) << body.name;
  }
  for (const content::DeformableBody& body : scene.bodies) {
    EXPECT_GT(body.fixed_nodes.size(), 20u) << body.name;
    EXPECT_LT(body.fixed_nodes.size(), body.mesh.nodes.size() / 3) << body.name;
  }
  const std::set<std::string> labels = [&] {
    std::set<std::string> names;
    for (const std::uint8_t label : scene.labels.labels) names.insert(scene.tissues[label].name);
    return names;
  }();
  for (const char* name : {"outside", "skin", "fat", "muscle", "bone", "liver", "tumour", "portal_blood",
                           "hepatic_blood", "bile", "kidney_cortex", "diaphragm", "peritoneal_fat"}) {
    EXPECT_TRUE(labels.contains(name)) << name;
  }
}

TEST(ShippedContent, EmbeddedSurfacesReproduceTheirRestShape) {
  const content::Scene& scene = default_scene_of_any_mesh();
  for (const content::Surface& surface : scene.surfaces) {
    if (surface.body < 0) continue;
    const auto& nodes = scene.bodies[surface.body].mesh.nodes;
    ASSERT_EQ(surface.embedding.size(), surface.positions.size());
    double worst = 0;
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
      Eigen::Vector3d sum = -surface.positions[i].cast<double>();
      for (std::size_t n = 0; n < 4; ++n) {
        sum += static_cast<double>(surface.embedding[i].weights[n]) * nodes[surface.embedding[i].nodes[n]];
      }
      worst = std::max(worst, sum.norm());
    }
    EXPECT_LT(worst, 1e-6) << surface.name;
  }
}

Procedure default_procedure() {
  files::JsonFile file(kContent / "organs" / "abdomen.json");
  const Procedure procedure = read_procedure(file);
  file.throw_problems();
  return procedure;
}

TEST(ShippedContent, MotionGoesWhereABiopsyGoes) {
  const content::Scene& scene = default_scene_of_any_mesh();
  const auto& stylus = scene.motion.stylus;
  const auto tip = [&](const content::MotionSample& sample) -> Eigen::Vector3d {
    return sample.pose.position + sample.pose.orientation * Eigen::Vector3d(0, 0, scene.needle.length);
  };
  const double duration = stylus.back().time_s - stylus.front().time_s;
  EXPECT_GE(duration, 10);
  EXPECT_LE(duration, 20);
  const double samples_hz = static_cast<double>(stylus.size() - 1) / duration;
  EXPECT_GE(samples_hz, 100);
  EXPECT_LE(samples_hz, 251);
  const content::Target& target = scene.targets.at(0);
  const auto fires = std::ranges::find(stylus, 1U, &content::MotionSample::buttons);
  ASSERT_NE(fires, stylus.end());

  // Where the needle enters the tumour: between its surface and its middle, since the liver gives way before that.
  const Eigen::Vector3d axis = (target.centre - tip(stylus.front())).normalized();
  const double short_of = axis.dot(target.centre - tip(*fires));
  EXPECT_GT(short_of, 0.001);
  EXPECT_LT(short_of, target.radius);

  // Along the plan, and never back before it fires; straight; fast as a hand; and out again.
  double deepest = -1;
  double side = 0;
  double speed = 0;
  for (auto sample = stylus.begin(); sample != stylus.end(); ++sample) {
    const double depth = axis.dot(tip(*sample) - target.centre);
    if (sample < fires) {
      EXPECT_GT(depth, deepest - 2e-4) << "but for a tremor";
    }
    deepest = std::max(deepest, depth);
    const Eigen::Vector3d hub = sample->pose.position - target.centre;
    side = std::max(side, (hub - axis.dot(hub) * axis).norm());
    if (sample != stylus.begin()) {
      const auto& before = *(sample - 1);
      const double dt = sample->time_s - before.time_s;
      speed = std::max(speed, std::abs(axis.dot(sample->pose.position - before.pose.position)) / dt);
    }
    EXPECT_GT((sample->pose.orientation * Eigen::Vector3d::UnitZ()).dot(axis), std::cos(0.05)) << "hub +Z to target";
  }
  EXPECT_LE(side, 0.002);
  EXPECT_GE(speed, 0.035);
  EXPECT_LE(speed, 0.050);
  const Eigen::Vector3d entry = default_procedure().entry;
  EXPECT_GT((tip(stylus.back()) - target.centre).norm(), (entry - target.centre).norm() + 0.02) << "withdrawn";
}

TEST(ShippedContent, NeedlePathPassesBetweenTheRibs) {
  const content::Scene& scene = default_scene_of_any_mesh();
  const content::MotionSample& end =
      *std::ranges::find(scene.motion.stylus, 1U, &content::MotionSample::buttons);  // when it fires
  const content::LabelVolume& labels = scene.labels;
  const Eigen::Vector3d chord = (scene.targets.at(0).centre - end.pose.position).normalized();  // of the bent needle
  bool liver = false;
  for (double s = 0; s <= scene.needle.length; s += 0.0005) {
    const Eigen::Vector3d p = end.pose.position + s * chord;
    const Eigen::Vector3i v = ((p.cast<float>() - labels.origin) / labels.spacing).array().round().cast<int>();
    if ((v.array() < 0).any() || (v.array() >= labels.size.array()).any()) continue;
    const auto index = (static_cast<std::size_t>(v.z()) * static_cast<std::size_t>(labels.size.y()) +
                        static_cast<std::size_t>(v.y())) *
                           static_cast<std::size_t>(labels.size.x()) +
                       static_cast<std::size_t>(v.x());
    const std::string& tissue = scene.tissues[labels.labels[index]].name;
    EXPECT_NE(tissue, "bone");
    EXPECT_NE(tissue, "cartilage");
    liver = liver || tissue == "liver";
  }
  EXPECT_TRUE(liver);
}

TEST(ShippedContent, MotionIsWhatItsGeneratorMakes) {
  const Procedure procedure = default_procedure();
  const content::Motion made = motion::biopsy_motion(
      motion::demonstration(procedure.entry, procedure.target, procedure.target_radius, default_needle().length));
  const auto shipped = default_motion().stylus;
  ASSERT_EQ(made.stylus.size(), shipped.size()) << "run make_motion again (content/motions/LICENCE.md)";
  for (std::size_t i = 0; i < shipped.size(); ++i) {
    ASSERT_LT((made.stylus[i].pose.position - shipped[i].pose.position).norm(), 2e-6);  // the file has micrometres
    ASSERT_NEAR(made.stylus[i].time_s, shipped[i].time_s, 1e-6);
  }
}

TEST(ShippedContent, ProbeIsHeldAtTheFirstViewOfTheProcedure) {
  const physics::RigidPose view = default_procedure().views.at(0).pose;
  const physics::RigidPose pose = default_scenario_file().probe_pose;
  // Pressed on the skin there, straight on, by as much as a hand presses.
  const Eigen::Vector3d pressed = view.orientation.conjugate() * (pose.position - view.position);
  EXPECT_LT(pressed.head<2>().norm(), 2e-6);
  EXPECT_NEAR(pressed.z(), 0.004, 1e-5);
  EXPECT_LT(pose.orientation.angularDistance(view.orientation), 1e-5) << "copy the view into the scenario";
}

void expect_schema_agrees(const std::string& name, const std::string& text, std::size_t objects,
                          const std::function<void(files::JsonFile&)>& read) {
  test::expect_schema_agrees(kContent / "schemas" / (name + ".schema.json"), kContent / "scenarios" / "full.json",
                             text, objects, read);
}

TEST(Schemas, AgreeWithTheReaders) {
  const auto shipped = [](const char* path) { return files::read_file(kContent / path, 16u << 20); };
  expect_schema_agrees("needle", shipped("needles/18g_150mm.json"), 1, [](files::JsonFile& f) { read_needle(f); });
  expect_schema_agrees("probe", shipped("probes/c5_2.json"), 1, [](files::JsonFile& f) { read_probe(f); });
  expect_schema_agrees("device",
                       R"({"format": "stylet-device", "version": 1, "matches": [{}], "rate": {}, "limits": {},
                           "reports": [{"fields": [{}]}]})",
                       6, [](files::JsonFile& f) { read_device_profile(f); });
  expect_schema_agrees("calibration",
                       R"({"format": "stylet-calibration", "version": 1, "deflection": {}, "rest_mm": 0})", 2,
                       [](files::JsonFile& f) { read_calibration(f); });
  expect_schema_agrees("procedure", shipped("organs/abdomen.json"), 3, [](files::JsonFile& f) { read_procedure(f); });
  expect_schema_agrees("motion", R"({"format": "stylet-motion", "version": 1, "device": {}, "tracks": {}})", 3,
                       [](files::JsonFile& f) { read_motion(f); });
  expect_schema_agrees("tissues", shipped("tissues.json"), 7, [](files::JsonFile& f) { content::read_tissues(f); });
  // Every optional object there is; the values do not matter.
  const char* full = R"({"format": "stylet-scenario", "version": 1, "probe": {},
    "organs": [{"nodes": {"a": {}}}],
    "bodies": [{"mesh": {}, "fixed": [{"box": {}, "outside_box": {}, "plane": {}}]}],
    "targets": [{}], "labels": {}, "camera": {}, "room_from_patient": {}, "rates": {},
    "contacts": [{}], "scoring": [{}], "breathing": {"rigid": {}}, "briefing": {}, "sampling": {},
    "hints": [{"when": {}}], "start": {}})";
  expect_schema_agrees("scenario", full, 25, [](files::JsonFile& f) { read_scenario_file(f); });
}

TEST(Schemas, AndTheReadmeAreMadeOfTheTablesOfKeys) {
  for (const files::FileFormat& format : formats()) test::expect_generated(kContent, format);
}

/// A value against the parts of JSON Schema that our schemas of generated files use.
void expect_follows(const json& value, const json& schema, const std::string& at) {
  if (schema.contains("const")) {
    EXPECT_EQ(value, schema["const"]) << at;
    return;
  }
  const std::string type = schema.at("type");
  EXPECT_TRUE((type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
              (type == "string" && value.is_string()) || (type == "number" && value.is_number()) ||
              (type == "integer" && value.is_number_integer()))
      << at << " is no " << type;
  if (schema.contains("minimum")) {
    EXPECT_GE(value.get<double>(), schema["minimum"].get<double>()) << at;
  }
  if (schema.contains("maximum")) {
    EXPECT_LE(value.get<double>(), schema["maximum"].get<double>()) << at;
  }
  if (schema.contains("minItems")) {
    EXPECT_GE(value.size(), schema["minItems"].get<std::size_t>()) << at;
  }
  if (schema.contains("maxItems")) {
    EXPECT_LE(value.size(), schema["maxItems"].get<std::size_t>()) << at;
  }
  if (type == "array") {
    for (const json& item : value) expect_follows(item, schema.at("items"), at + "/*");
  }
  if (type != "object") return;
  for (const auto& key : schema.at("required")) EXPECT_TRUE(value.contains(key)) << at << " lacks " << key;
  for (const auto& [key, item] : value.items()) {
    ASSERT_TRUE(schema.at("properties").contains(key)) << at << '/' << key << " is in no schema";
    expect_follows(item, schema["properties"][key], std::string(at).append("/").append(key));
  }
}

TEST(Schemas, ReferenceInsertionFollowsItsSchema) {  // its reader belongs to the benches
  const files::JsonFile schema(kContent / "schemas" / "reference.schema.json");
  const files::JsonFile file(kContent / "reference" / "r1.json");
  expect_follows(file.tree(), schema.tree(), "reference/r1.json");
}

}  // namespace
}  // namespace stylet::readers
