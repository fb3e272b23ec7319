// A real abdomen: 35 surfaces of a CT become a scenario by one short side file, and a needle goes into it.
#include "engine/import/scenario_folder.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace stylet::import {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::filesystem::path kContent = std::filesystem::path(STYLET_SOURCE_DIR) / "content";

content::Motion straight(const ImportedScene& scene, const content::Needle& needle) {
  return motion::biopsy_motion({.entry = scene.entry,
                                .target = scene.target,
                                .needle_length = needle.length,
                                .wait = 0,
                                .lateral = 0,
                                .steer = 0,
                                .lead = 0,
                                .beyond = 0.001});
}

const json& named(const json& list, const std::string& key, const std::string& name) {
  for (const json& entry : list) {
    if (entry[key] == name) return entry;
  }
  ADD_FAILURE() << "no " << name;
  return list.front();
}

/// Largest force on the hand and largest distance of a node from rest, over a session.
class Extremes : public session::StepListener {
public:
  explicit Extremes(const content::Scene& scene) : scene_(scene) {}
  void haptic_stepped(const recording::HapticStepRecord&, const physics::NeedleState& needle) override {
    const double force = needle.wrench.force.norm();
    finite = finite && std::isfinite(force);
    largest_force = std::max(largest_force, force);
    punctures = needle.puncture_count;
  }
  void simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport& report,
                          const physics::TissueState& tissue, const physics::NeedleState&) override {
    inverted += report.inverted_tets;
    shortened += (report.flags & physics::kSimulationStepLimited) != 0 ? 1 : 0;
    for (int b = 0; b < tissue.body_count; ++b) {
      for (Eigen::Index n = 0; n < tissue.positions[b].cols(); ++n) {
        const Eigen::Vector3d rest = scene_.bodies[b].mesh.nodes[n];
        largest_move = std::max(largest_move, (tissue.positions[b].col(n) - rest).norm());
      }
    }
  }
  bool finite = true;
  double largest_force = 0;  // N
  double largest_move = 0;   // m
  int inverted = 0;
  int shortened = 0;  // steps of the correction
  std::uint32_t punctures = 0;

private:
  const content::Scene& scene_;
};

TEST(TsAbdomen, BecomesAScenarioThatANeedleGoesInto) {
  const char* data = std::getenv("STYLET_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "STYLET_TEST_DATA is not set";
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; the torso of spheres takes the same ways";
  const std::filesystem::path source = std::filesystem::path(data) / "organs/ts_abdomen/ts_abdomen.glb";
  files::JsonFile side_json(kContent / "imports" / "ts_abdomen.json");
  const SideFile side = read_side_file(side_json);
  side_json.throw_problems();
  const support::TemporaryFolder folder;
  const ScenarioFolder written = write_scenario({read_source(source, {})}, side, folder / "out", kContent, "test",
                                                straight, [](const std::string&, double) {});
  EXPECT_THAT(written.warnings, IsEmpty());

  // What the report says against what is known of the source.
  const json report = json::parse(files::read_file(folder / "out/report.json", 1u << 20));
  EXPECT_THAT(report["left_out"], IsEmpty());
  ASSERT_EQ(report["scan_cuts"].size(), 2u);
  EXPECT_EQ(report["scan_cuts"][1]["towards"], "the head");
  const json& organs = report["organs"];
  EXPECT_THAT(named(organs, "id", "liver")["notes"].get<std::vector<std::string>>(),
              Contains(HasSubstr("cut off flat by the end of the scan towards the head")));
  EXPECT_NEAR(named(organs, "id", "liver")["volume_m3"].get<double>(), 1118.6e-6, 1e-6);
  EXPECT_NEAR(named(organs, "id", "lesion")["volume_m3"].get<double>(), 7.2e-6, 0.1e-6);
  EXPECT_EQ(named(organs, "id", "ribs")["parts"].size(), 12u);
  for (const json& overlap : report["overlaps"]) EXPECT_LT(overlap["share_of_smaller"], 0.03) << overlap;
  EXPECT_EQ(report["path"].back()["organ"], "lesion");

  std::optional<content::Scene> scene;
  EXPECT_THAT(readers::validate(folder / "out/scenario.json", &scene), IsEmpty());
  ASSERT_TRUE(scene);
  ASSERT_EQ(written.bodies.size(), 2u);
  for (const BodyAccount& body : written.bodies) {
    std::printf("  %s: %zu nodes, %zu held, %+.2f %%, %.1f degrees\n", body.name.c_str(), body.nodes, body.held,
                100 * (body.volume / body.surface_volume - 1), body.min_dihedral_deg);
    EXPECT_EQ(body.inverted, 0) << body.name;
    EXPECT_GE(body.min_dihedral_deg, 12) << body.name;
    EXPECT_NEAR(body.volume / body.surface_volume, 1, 0.03) << body.name;
  }

  // The wall: as deep as asked for, clear of the organs.
  const gltf::GltfScene organ_file = gltf::read_gltf(folder / "out/organs.glb");
  const auto solid = [&](const std::string& name) {
    for (const gltf::GltfOrgan& organ : organ_file.organs) {
      if (organ.name == name) return mesh::Solid(mesh::clean_surface(organ.mesh, name));
    }
    throw files::ContentError("no organ " + name);
  };
  const mesh::Solid skin = solid("body_skin"), wall = solid("abdominal_wall"), liver = solid("liver");
  double deepest = 0, nearest = 1;
  for (const Eigen::Vector3d& v : wall.surface().vertices) {
    deepest = std::max(deepest, -skin.signed_distance(v));
    nearest = std::min(nearest, liver.signed_distance(v));
  }
  EXPECT_NEAR(deepest, side.scenario->wall.depth, 0.7e-3);
  EXPECT_GT(nearest, 0.5e-3);

  // The needle goes through the wall and the liver into the lesion, and nothing comes apart.
  haptic::RecordedDevice device = session::recorded_stylus(scene->motion);
  const haptic::StylusSample first = device.read(0);
  Extremes extremes(*scene);
  session::CoupledLoops loops(*scene, physics::Coupling::stylet, {first.position, first.orientation}, {&extremes});
  const session::RunStatistics run = session::run_lockstep(loops, device, *scene, 5.2);
  std::printf("  largest force %.2f N, largest displacement %.1f mm, %u punctures, %d of 260 steps shortened\n",
              extremes.largest_force, 1e3 * extremes.largest_move, extremes.punctures, extremes.shortened);
  EXPECT_TRUE(extremes.finite);
  EXPECT_EQ(extremes.inverted, 0);
  EXPECT_GT(extremes.largest_force, 1);
  EXPECT_LT(extremes.largest_force, 8);
  EXPECT_LT(extremes.largest_move, 0.025);
  EXPECT_EQ(extremes.punctures, 5u) << "skin, fat, muscle, liver, lesion";
  EXPECT_EQ(run.needle_flags, 0u);
  // Where the skin lets go of the needle a step of the correction is shortened so as not to overshoot.
  EXPECT_EQ(run.simulation_flags & ~physics::kSimulationStepLimited, 0u);
  EXPECT_EQ(run.patch_flags, 0u);
  EXPECT_LE(extremes.shortened, 13) << "of 260: a twentieth";
}

}  // namespace
}  // namespace stylet::import
