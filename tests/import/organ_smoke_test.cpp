// Every organ of the test data that can be imported, in the physics: under its weight and under a needle for 2 s.
#include "engine/files/error.h"
#include "engine/import/organ_import.h"
#include "engine/mesh/surface_mesh.h"
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

namespace stylet::import {
namespace {

constexpr double kGravity = 9.81, kDensity = 1060;
constexpr int kSimulationHz = 50, kHapticHz = 1000;

bool is_bone(const std::string& organ) {
  return organ.starts_with("rib_") || organ.starts_with("vertebrae") || organ.starts_with("costal");
}

/// The nodes of each connected part.
std::vector<std::vector<int>> pieces_of(const physics::TetMesh& mesh) {
  std::vector<int> part(mesh.nodes.size());
  std::iota(part.begin(), part.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& tet : mesh.tets) {
      int least = part[tet[0]];
      for (const int n : tet) least = std::min(least, part[n]);
      for (const int n : tet) {
        changed = changed || part[n] != least;
        part[n] = least;
      }
    }
  }
  std::map<int, std::vector<int>> pieces;
  for (std::size_t n = 0; n < part.size(); ++n) pieces[part[n]].push_back(static_cast<int>(n));
  std::vector<std::vector<int>> list;
  list.reserve(pieces.size());
  for (auto& [first, nodes] : pieces) list.push_back(std::move(nodes));
  return list;
}

/// Supine: gravity points to the back, and each piece rests on the third of its nodes that lies lowest.
physics::SimulationBody resting(const physics::TetMesh& mesh, double young_modulus) {
  physics::SimulationBody body;
  body.mesh = mesh;
  body.tet_materials.assign(mesh.tets.size(), {.young_modulus = young_modulus, .poisson_ratio = 0.45});
  body.load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(mesh.nodes.size()));
  for (const auto& tet : mesh.tets) {
    const auto x = [&](std::size_t c) { return mesh.nodes[tet[c]]; };
    const double volume = (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) / 6;
    for (const int node : tet) body.load(2, node) -= kDensity * kGravity * volume / 4;
  }
  for (std::vector<int>& piece : pieces_of(mesh)) {
    std::ranges::sort(piece, {}, [&](int n) { return mesh.nodes[n].z(); });
    body.fixed_nodes.insert(body.fixed_nodes.end(), piece.begin(),
                            piece.begin() + static_cast<std::ptrdiff_t>(piece.size() / 3));
  }
  std::ranges::sort(body.fixed_nodes);
  return body;
}

struct Smoke {
  bool finite = true;
  int inverted = 0;    // tetrahedra at the end
  double settled = 0;  // largest motion of a node, m
  double force = 0;    // largest, N
  unsigned punctures = 0;
};

/// Of the highest tetrahedron.
Eigen::Vector3d middle_of_top(const physics::TetMesh& mesh, const Eigen::Matrix3Xd& now) {
  Eigen::Vector3d top(0, 0, -1e9);
  for (const auto& tet : mesh.tets) {
    const Eigen::Vector3d middle = (now.col(tet[0]) + now.col(tet[1]) + now.col(tet[2]) + now.col(tet[3])) / 4;
    if (middle.z() > top.z()) top = middle;
  }
  return top;
}

/// It settles; then a needle comes straight down on its top, 15 mm into it and out again.
Smoke smoke(const physics::TetMesh& mesh, double young_modulus) {
  constexpr double kSpeed = 0.060, kDepth = 0.015, kDuration = 2.0, kSettled = 0.8;
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(resting(mesh, young_modulus));
  physics::SimulationLoop simulation(std::move(bodies), {.dt = 1.0 / kSimulationHz, .lay_contacts = false});

  physics::HapticLoopSettings settings;
  settings.coupling = physics::Coupling::stylet;
  auto map = std::make_shared<physics::TissueMap>();
  map->tissues[1] = {.puncture_force = 0.8, .cutting_force = 0.5, .friction_per_length = 18};
  settings.tissues = map;
  Eigen::Vector3d top(0, 0, 1);
  const auto hub = [&](double time) {
    const double way =
        kSpeed * std::min(time - kSettled, kDuration - time) + (kDepth + 0.015 - 0.6 * kSpeed);  // there and back
    physics::StylusPose pose;
    pose.orientation = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());  // +Z down
    pose.position = top + Eigen::Vector3d(0, 0, settings.needle.length + 0.015 - std::max(way, 0.0));
    return pose;
  };
  physics::HapticLoop haptic(settings, hub(0));
  physics::TissuePatch patch = simulation.make_patch();
  Smoke seen;
  for (int step = 0; step < static_cast<int>(kDuration * kHapticHz); ++step) {
    const double time = static_cast<double>(step) / kHapticHz;
    if (step == static_cast<int>(kSettled * kHapticHz)) {
      top = middle_of_top(mesh, simulation.tissue().positions[0]);
      haptic = physics::HapticLoop(settings, hub(time));
    }
    if (step % (kHapticHz / kSimulationHz) == 0) {
      const auto report = simulation.step({.needle = &haptic.state(), .time_s = time}, patch);
      simulation.worker().step();
      seen.inverted = report.inverted_tets;
    }
    const physics::NeedleState& needle = haptic.step(hub(time), 1.0 / kHapticHz, patch);
    seen.finite = seen.finite && needle.positions.leftCols(needle.node_count).allFinite();
    seen.force = std::max(seen.force, needle.wrench.force.norm());
    seen.punctures = needle.puncture_count;
  }
  const Eigen::Matrix3Xd& now = simulation.tissue().positions[0];
  seen.finite = seen.finite && now.allFinite();
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    seen.settled = std::max(seen.settled, (now.col(static_cast<Eigen::Index>(n)) - mesh.nodes[n]).norm());
  }
  return seen;
}

class RealOrganInThePhysics : public ::testing::TestWithParam<const char*> {};

TEST_P(RealOrganInThePhysics, BearsItsWeightAndANeedle) {
  const char* data = std::getenv("STYLET_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "STYLET_TEST_DATA is not set";
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  const std::vector<SourceFile> files{read_source(std::filesystem::path(data) / "organs" / GetParam(), {})};
  int run = 0, met = 0;
  for (const OrganParts& parts : assign_parts(files, {})) {
    ImportedOrgan organ;
    try {
      organ = import_organ(parts, {.target_nodes = 400}, [](const std::string&, double) {});
    } catch (const files::ContentError& error) {
      std::printf("  refused: %s\n", error.what());
      continue;
    }
    SCOPED_TRACE(organ.id);
    const Smoke seen = smoke(organ.mesh, is_bone(organ.id) ? 10e6 : 20e3);
    ++run;
    met += seen.force > 0.02 ? 1 : 0;
    const Eigen::Vector3d size = mesh::inspect(organ.surface).bounds.sizes();
    std::printf("  %-24s %4zu nodes, moved by %5.1f of %3.0f mm, at most %.2f N, %u punctures\n", organ.id.c_str(),
                organ.mesh.nodes.size(), 1e3 * seen.settled, 1e3 * size.norm(), seen.force, seen.punctures);
    EXPECT_TRUE(seen.finite);
    EXPECT_EQ(seen.inverted, 0);
    EXPECT_LT(seen.settled, 0.5 * size.norm());
    EXPECT_LT(seen.force, is_bone(organ.id) ? 66 : 10);
  }
  EXPECT_GT(run, 0);
  EXPECT_GE(met, 9 * run / 10) << "slender ones may sag away from the needle";
}

INSTANTIATE_TEST_SUITE_P(TestData, RealOrganInThePhysics,
                         ::testing::Values("hubmap/VH_M_Spleen.glb", "ts_abdomen/ts_abdomen.glb"),
                         [](const auto& tested) { return std::filesystem::path(tested.param).stem().string(); });

}  // namespace
}  // namespace stylet::import
