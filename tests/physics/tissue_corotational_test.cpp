// Rotations of corotational tetrahedra; what theory says of their forces is in tests/validation.
#include "physics/tissue/corotational.h"

#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <random>

namespace stylet::physics {
namespace {

constexpr double kYoung = 10e3;

/// An irregular 100 mm cube with the face z = 0 fixed.
TissueModel irregular_cube(int cells, double poisson_ratio) {
  TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
  reference::jitter_inner_nodes(mesh, 0.2 * 0.1 / cells, 7);
  const auto fixed = reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kYoung, poisson_ratio});
  return TissueModel(std::move(mesh), materials, fixed);
}

Eigen::Matrix3d some_rotation() {
  return Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

std::vector<Eigen::Quaterniond> identity_rotations(const TissueModel& model) {
  return std::vector<Eigen::Quaterniond>(model.tets.size(), Eigen::Quaterniond::Identity());
}

TEST(Corotational, ClosestRotationIsThePolarFactor) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
    Eigen::Matrix3d a = Eigen::Matrix3d::NullaryExpr([&] { return 0.3 * normal(random); });
    const Eigen::Matrix3d stretch = a * a.transpose() + 0.2 * Eigen::Matrix3d::Identity();  // SPD: F = R S
    const Eigen::Quaterniond cold = closest_rotation(q.toRotationMatrix() * stretch, Eigen::Quaterniond::Identity());
    const Eigen::Quaterniond warm =
        closest_rotation(q.toRotationMatrix() * stretch, q * Eigen::Quaterniond(1, .05, -.04, .03).normalized());
    worst = std::max({worst, q.angularDistance(cold), q.angularDistance(warm)});
  }
  std::printf("  largest angle to the polar factor: %.2e rad\n", worst);
  EXPECT_LT(worst, 1e-13);
}

// However far off it begins: what is left of a small step is of third order, so none is needed after it.
TEST(Corotational, ClosestRotationIsThePolarFactorFromEverySmallDistance) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(normal(random), direction()));
    const Eigen::Matrix3d a = Eigen::Matrix3d::NullaryExpr([&] { return 0.3 * normal(random); });
    const Eigen::Matrix3d f = q.toRotationMatrix() * (a * a.transpose() + 0.2 * Eigen::Matrix3d::Identity());
    for (const double angle : {1e-8, 1e-6, 1e-5, 1.9e-5, 2.1e-5, 1e-4, 1e-3, 1e-2}) {
      std::array<Lanes, 4> four;
      const Eigen::Quaterniond start = q * Eigen::Quaterniond(Eigen::AngleAxisd(angle, direction()));
      for (std::size_t k = 0; k < 4; ++k) four[k].setConstant(start.coeffs()[static_cast<Eigen::Index>(k)]);
      LaneMatrix gradient;
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
          gradient[r][c].setConstant(f(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)));
        }
      }
      ASSERT_TRUE(closest_rotations(gradient, four));
      const Eigen::Quaterniond together(four[3][1], four[0][1], four[1][1], four[2][1]);
      worst = std::max({worst, q.angularDistance(closest_rotation(f, start)), q.angularDistance(together)});
    }
  }
  std::printf("  largest angle to the polar factor: %.2e rad\n", worst);
  EXPECT_LT(worst, 1e-13);
}

TEST(Corotational, InvertedTetrahedronIsPushedBack) {
  TetMesh mesh;
  mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tets = {{0, 1, 2, 3}};
  const std::vector<int> fixed{0, 1, 2};
  const std::vector<ElasticMaterial> materials{{1.0, 0.3}};
  const TissueModel model(mesh, materials, fixed);
  for (const double height : {-0.5, -1e-12, 0.0, 1e-12}) {  // inverted, and degenerate
    Eigen::Matrix3Xd p = rest_positions(model);
    p.col(3).z() = height;
    auto rotations = identity_rotations(model);
    EXPECT_EQ(update_rotations(model, p, rotations), height <= 0 ? 1 : 0);
    Eigen::Matrix3Xd forces(3, 4);
    internal_forces(model, p, rotations, forces);
    ASSERT_TRUE(forces.allFinite());
    EXPECT_LT(forces(2, 3), 0) << "height " << height;  // F_int < 0: the tetrahedron pushes its apex up
  }
}

TEST(Corotational, RotationsOfABodyThatTurnsAsOneAreItsRotation) {
  const TissueModel model = irregular_cube(2, 0.3);
  auto rotations = identity_rotations(model);
  EXPECT_EQ(update_rotations(model, some_rotation() * rest_positions(model), rotations), 0);
  for (const Eigen::Quaterniond& q : rotations) EXPECT_LT((q.toRotationMatrix() - some_rotation()).norm(), 1e-12);
}

}  // namespace
}  // namespace stylet::physics
