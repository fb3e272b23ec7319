#include "engine/mesh/quadratic_mesh.h"

#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"
#include "engine/mesh/tetrahedralise.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "tests/mesh/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::mesh {
namespace {

constexpr double kBallRadius = 0.05;
constexpr double kBallVolume = 4.0 / 3 * std::numbers::pi * kBallRadius * kBallRadius * kBallRadius;
const Eigen::AlignedBox3d kBallBox(Eigen::Vector3d::Constant(-kBallRadius), Eigen::Vector3d::Constant(kBallRadius));

double ball(const Eigen::Vector3d& x) {
  return x.norm() - kBallRadius;
}

/// Elements, all of them well oriented where strain is measured, and tetrahedra with angles that contact can use.
void expect_elements(const physics::TetMesh& mesh) {
  ASSERT_EQ(mesh.tets.size() % physics::kTetsOfRefined, 0u);
  for (std::size_t e = 0; e < mesh.tets.size() / physics::kTetsOfRefined; ++e) {
    const Eigen::Array4d volumes = physics::volumes_at_points(mesh, e);
    EXPECT_GT(volumes.minCoeff(), 0.4 * volumes.mean()) << e;
  }
  const TetQuality quality = tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0);
  EXPECT_GE(quality.min_dihedral_deg, 10);
  const SurfaceReport report = inspect(boundary_surface(mesh).mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.oriented());
}

TEST(QuadraticMesh, MiddlesOfEdgesOnTheBoundaryLieOnTheSurface) {
  for (const double cell : {0.016, 0.023, 0.035}) {
    const physics::TetMesh coarse = stuff(ball, kBallBox, cell);
    const physics::TetMesh mesh = refined_on_surface(coarse, ball);
    expect_elements(mesh);
    double farthest = 0, farthest_straight = 0;
    for (const int n : boundary_surface(mesh).nodes) farthest = std::max(farthest, std::abs(ball(mesh.nodes[n])));
    const physics::TetMesh straight = physics::refined(coarse);
    for (const int n : boundary_surface(straight).nodes)
      farthest_straight = std::max(farthest_straight, std::abs(ball(straight.nodes[n])));
    EXPECT_LT(farthest, 0.02 * cell);
    EXPECT_LT(farthest, 0.3 * farthest_straight) << "or nothing has moved";
    const double error = std::abs(tet_quality(mesh).volume / kBallVolume - 1);
    EXPECT_LT(error, 0.5 * std::abs(tet_quality(straight).volume / kBallVolume - 1));
  }
}

TEST(QuadraticMesh, HasAboutTheNodesOfLinearTetrahedra) {
  const TriangleMesh surface = test::icosphere(Eigen::Vector3d::Zero(), kBallRadius, 3);
  for (const int wanted : {700, 2300}) {
    for (const auto element : {physics::Element::linear, physics::Element::quadratic}) {
      const physics::TetMesh mesh =
          tetrahedralise(surface, {.element = element, .target_nodes = wanted, .where = "ball"});
      EXPECT_NEAR(static_cast<double>(mesh.nodes.size()), wanted, 0.12 * wanted);
      if (element == physics::Element::quadratic) expect_elements(mesh);
    }
  }
}

// Sharp edges and thin parts: what cannot be moved well stays straight.
TEST(QuadraticMesh, IsSoundWhereTheSurfaceIsSharpOrThin) {
  const auto plate = [](const Eigen::Vector3d& x) {
    const Eigen::Vector3d q = x.cwiseAbs() - Eigen::Vector3d(0.05, 0.04, 0.012);
    return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
  };
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.05, -0.04, -0.012), Eigen::Vector3d(0.05, 0.04, 0.012));
  for (const double cell : {0.012, 0.017, 0.021}) {
    const physics::TetMesh mesh = refined_on_surface(stuff(plate, box, cell), plate);
    ASSERT_FALSE(mesh.tets.empty());
    expect_elements(mesh);
    EXPECT_NEAR(tet_quality(mesh).volume, box.volume(), 0.15 * box.volume());
  }
}

TEST(QuadraticMesh, SameInputGivesTheSameBits) {
  const physics::TetMesh coarse = stuff(ball, kBallBox, 0.02);
  const physics::TetMesh once = refined_on_surface(coarse, ball), twice = refined_on_surface(coarse, ball);
  EXPECT_EQ(once.nodes, twice.nodes);
  EXPECT_EQ(once.tets, twice.tets);
}

}  // namespace
}  // namespace stylet::mesh
