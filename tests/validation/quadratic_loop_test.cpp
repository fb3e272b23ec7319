// The simulation loop with quadratic elements: the same equilibrium as energy alone gives, and the compliance of it.
#include "physics/loops/simulation_loop.h"

#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "tests/validation/static_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::physics {
namespace {

constexpr double kEdge = 0.1;

SimulationBody cube(double poisson_ratio) {
  SimulationBody body;
  TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kEdge), {3, 3, 3});
  reference::jitter_inner_nodes(coarse, 0.005, 3);
  body.mesh = refined(coarse);
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, poisson_ratio});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  body.element = Element::quadratic;
  return body;
}

/// Spread over the top face's nodes, so that its volume can stay.
Eigen::Matrix3Xd pull(const SimulationBody& body, const Eigen::Vector3d& force) {
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(body.mesh.nodes.size()));
  const auto top = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() > kEdge - 1e-9; });
  for (const int n : top) load.col(n) = force / static_cast<double>(top.size());
  return load;
}

/// Steps until the residual is 1e-11 N.
int settle(const SimulationBody& body, bool refactorise) {
  validation::StaticBody exact(TissueModel(body.mesh, body.tet_materials, body.fixed_nodes, 0, Element::quadratic));
  EXPECT_LE(exact.relax(body.load, 1e-11, 300), 300);
  const Eigen::Matrix3Xd motion = exact.positions - rest_positions(exact.model());
  SimulationLoop loop({body}, {.dt = 0.02});
  TissuePatch patch = loop.make_patch();
  SimulationReport report;
  int steps = 0;
  do {
    report = loop.step({.request_factorisation = refactorise}, patch);
    loop.worker().step();
  } while (report.residual_n > 1e-11 && ++steps < 2000);
  const double error = (loop.tissue().positions[0] - exact.positions).norm() / motion.norm();
  std::printf("  nu %.3f, factor %s: %d steps, off the equilibrium by %.1e; largest move %.1f mm\n",
              body.tet_materials[0].poisson_ratio, refactorise ? "renewed" : "at rest", steps, error,
              1e3 * motion.colwise().norm().maxCoeff());
  EXPECT_LT(error, 1e-8);
  return steps;
}

// A stretch that hardly any tissue sees; the factor must follow it, since where volume stays the way is curved.
TEST(QuadraticLoop, FindsTheEquilibriumOfALargeStretch) {
  for (const double poisson_ratio : {0.45, 0.49, 0.499}) {
    SimulationBody body = cube(poisson_ratio);
    body.load = pull(body, Eigen::Vector3d(12, 3, 10));
    EXPECT_LT(settle(body, true), 300);
  }
}

// Layers twenty times stiffer along than across: of what turns with them K leaves out a part.
TEST(QuadraticLoop, FindsTheEquilibriumOfLayers) {
  for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, 0, 0.8)}) {
    SimulationBody body = cube(0.49);
    for (ElasticMaterial& material : body.tet_materials)
      material.layers = {.across = 0.05, .normal = {normal.x(), normal.y(), normal.z()}};
    body.load = pull(body, Eigen::Vector3d(0.4, 0.1, 0.3));
    EXPECT_LT(settle(body, true), 300);
    body.load = -body.load;  // pressed
    EXPECT_LT(settle(body, true), 300);
  }
}

// A finger's push into three nodes of an edge: tetrahedra of the mesh are squeezed flat where the points of their
// element are not. If nothing kept them from it no step could be taken any more, and the body would stand still
// unbalanced.
TEST(QuadraticLoop, IsNotHeldUpByTetrahedraSqueezedFlat) {
  SimulationBody body = cube(0.49);
  body.load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(body.mesh.nodes.size()));
  const auto pushed = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) {
    return x.z() > kEdge - 1e-9 && (x - Eigen::Vector3d(0.05, 0.05, kEdge)).norm() < 0.02;
  });
  ASSERT_FALSE(pushed.empty());
  for (const int n : pushed) body.load.col(n).z() = -20.0 / static_cast<double>(pushed.size());
  SimulationLoop loop({body}, {.dt = 0.02});
  TissuePatch patch = loop.make_patch();
  SimulationReport report;
  int steps = 0;
  do {
    report = loop.step({.request_factorisation = true}, patch);
    loop.worker().step();
    EXPECT_EQ(report.inverted_tets, 0);
  } while (report.residual_n > 1e-9 && ++steps < 600);
  std::vector<SqueezedTet> squeezed;
  find_squeezed(loop.model(0), loop.tissue().positions[0], {}, squeezed);
  const auto flat = std::ranges::count_if(squeezed, [](const SqueezedTet& s) { return s.tet % kSqueezable >= 4; });
  std::printf("  %d steps, residual %.1e N, %d tetrahedra flat\n", steps, report.residual_n, static_cast<int>(flat));
  EXPECT_GT(flat, 0);
  EXPECT_LT(steps, 600);
}

TEST(QuadraticLoop, FindsTheEquilibriumWithTheFactorOfRest) {
  for (const double poisson_ratio : {0.45, 0.49}) {
    SimulationBody body = cube(poisson_ratio);
    body.load = pull(body, Eigen::Vector3d(1.5, 0.4, 1.2));
    EXPECT_LE(settle(body, false), 2000);
  }
}

}  // namespace
}  // namespace stylet::physics
