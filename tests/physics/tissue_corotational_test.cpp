// Corotational tetrahedra against what continuum mechanics says of them.
#include "physics/tissue/corotational.h"

#include "physics/tissue/factorisation.h"
#include "tests/support/dense_tissue.h"
#include "tests/support/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/LU>
#include <Eigen/QR>

#include <cstdio>
#include <random>

namespace stylet::physics {
namespace {

constexpr double kYoung = 10e3;

/// An irregular 100 mm cube with the face z = 0 fixed.
TissueModel irregular_cube(int cells, double poisson_ratio) {
  TetMesh mesh = support::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
  support::jitter_inner_nodes(mesh, 0.2 * 0.1 / cells, 7);
  const auto fixed = support::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
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

TEST(Corotational, PatchTestHoldsOnIrregularMesh) {
  // All surface nodes follow an affine map of large rotation and 5 % strain; the inner nodes must find it.
  TetMesh mesh = support::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {4, 4, 4});
  support::jitter_inner_nodes(mesh, 0.005, 11);
  const auto surface = support::nodes_where(
      mesh, [](const Eigen::Vector3d& x) { return (x.array() < 1e-9).any() || (x.array() > 0.1 - 1e-9).any(); });
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kYoung, 0.45});
  const TissueModel model(mesh, materials, surface);
  Eigen::Matrix3d affine;
  affine << 1.04, 0.03, 0, 0.01, 0.97, -0.02, 0.02, 0, 1.05;
  affine = some_rotation() * affine;
  const Eigen::Vector3d shift(0.02, -0.05, 0.3);
  const Eigen::Matrix3Xd exact = (affine * rest_positions(model)).colwise() + shift;

  Eigen::Matrix3Xd p = exact;
  for (int n = 0; n < model.node_count(); ++n) {
    if (model.free_index[static_cast<std::size_t>(n)] >= 0) p.col(n) += 0.001 * Eigen::Vector3d(1, -1, 0.5);
  }
  SolveWorkspace workspace;
  const StiffnessPattern pattern(model);
  Factorisation factor(pattern, workspace);
  std::vector<double> values(pattern.nonzeros());
  auto rotations = identity_rotations(model);
  Eigen::Matrix3Xd forces(3, model.node_count());
  for (int i = 0; i < 30; ++i) {
    update_rotations(model, p, rotations);
    internal_forces(model, p, rotations, forces);
    pattern.assemble(model, rotations, 1, values);
    ASSERT_TRUE(factor.factorise(pattern, values, workspace));
    Eigen::VectorXd x(model.dof_count());
    for (int n = 0; n < model.node_count(); ++n) {
      const int f = model.free_index[static_cast<std::size_t>(n)];
      if (f >= 0) x.segment<3>(3 * f) = forces.col(n);
    }
    factor.solve(x, x, workspace);
    for (int n = 0; n < model.node_count(); ++n) {
      const int f = model.free_index[static_cast<std::size_t>(n)];
      if (f >= 0) p.col(n) -= x.segment<3>(3 * f);
    }
  }
  const double error = (p - exact).cwiseAbs().maxCoeff() / 0.1;
  std::printf("  patch test: largest error %.2e of the edge\n", error);
  EXPECT_LT(error, 1e-12);
}

TEST(Corotational, RigidMotionMakesNoForce) {
  const TissueModel model = irregular_cube(4, 0.45);
  const Eigen::Matrix3Xd p = (some_rotation() * rest_positions(model)).colwise() + Eigen::Vector3d(0.1, 0.2, -0.3);
  auto rotations = identity_rotations(model);
  EXPECT_EQ(update_rotations(model, p, rotations), 0);
  Eigen::Matrix3Xd forces(3, model.node_count());
  internal_forces(model, p, rotations, forces);
  // Scale: Young's modulus times the area of an element's face.
  const double scale = kYoung * 0.025 * 0.025;
  std::printf("  force of a rigid motion: %.2e N (E h^2 = %.2f N)\n", forces.cwiseAbs().maxCoeff(), scale);
  EXPECT_LT(forces.cwiseAbs().maxCoeff(), 1e-12 * scale);
}

TEST(Corotational, ForceIsTheGradientOfTheEnergy) {
  const TissueModel model = irregular_cube(2, 0.45);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-0.006, 0.006);
  Eigen::Matrix3Xd p = some_rotation() * rest_positions(model);
  for (Eigen::Index i = 0; i < p.size(); ++i) p.data()[i] += shift(random);
  auto rotations = identity_rotations(model);
  ASSERT_EQ(update_rotations(model, p, rotations), 0);
  Eigen::Matrix3Xd forces(3, model.node_count());
  internal_forces(model, p, rotations, forces);
  const double h = 1e-6;
  double worst = 0;
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const auto energy = [&](double offset) {
      Eigen::Matrix3Xd moved = p;
      moved.data()[i] += offset;
      auto r = rotations;
      update_rotations(model, moved, r);
      return elastic_energy(model, moved, r);
    };
    worst = std::max(worst, std::abs((energy(h) - energy(-h)) / (2 * h) - forces.data()[i]));
  }
  std::printf("  |dU/dp - F_int| / |F_int| = %.2e\n", worst / forces.cwiseAbs().maxCoeff());
  EXPECT_LT(worst, 1e-8 * forces.cwiseAbs().maxCoeff());
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

TEST(Corotational, CantileverLocksAsLinearTetrahedraDo) {
  // Tip deflection over Timoshenko's; reference values of Kuhn tetrahedra, 10 x 2 x 2 cells.
  const struct {
    double poisson_ratio;
    double expected;
  } rows[] = {{0.3, 0.507}, {0.45, 0.306}};
  for (const auto& row : rows) {
    TetMesh mesh = support::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d(1, 0.2, 0.2), {10, 2, 2});
    const auto clamped = support::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.x() < 1e-9; });
    const auto tip = support::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.x() > 1 - 1e-9; });
    const std::vector<ElasticMaterial> materials(mesh.tets.size(), {1e6, row.poisson_ratio});
    const TissueModel model(std::move(mesh), materials, clamped);
    SolveWorkspace workspace;
    const StiffnessPattern pattern(model);
    Factorisation factor(pattern, workspace);
    std::vector<double> values(pattern.nonzeros());
    pattern.assemble(model, identity_rotations(model), 1, values);
    ASSERT_TRUE(factor.factorise(pattern, values, workspace));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(model.dof_count());
    for (const int n : tip) x[3 * model.free_index[static_cast<std::size_t>(n)] + 2] = 1.0 / double(tip.size());
    factor.solve(x, x, workspace);
    double deflection = 0;
    for (const int n : tip)
      deflection += x[3 * model.free_index[static_cast<std::size_t>(n)] + 2] / double(tip.size());
    const double inertia = std::pow(0.2, 4) / 12;
    const double shear_modulus = 1e6 / (2 * (1 + row.poisson_ratio));
    const double timoshenko = 1 / (3 * 1e6 * inertia) + 1 / (5.0 / 6.0 * shear_modulus * 0.04);
    std::printf("  nu %.2f: tip / Timoshenko %.4f (reference %.3f)\n", row.poisson_ratio, deflection / timoshenko,
                row.expected);
    EXPECT_NEAR(deflection / timoshenko, row.expected, 0.02 * row.expected);
  }
}

TEST(Corotational, RotationOfANodeIsThatOfItsBody) {
  const TissueModel model = irregular_cube(2, 0.3);
  auto now = identity_rotations(model);
  update_rotations(model, some_rotation() * rest_positions(model), now);
  const Eigen::Quaterniond q = node_rotation(model, 13, identity_rotations(model), now);
  EXPECT_LT((q.toRotationMatrix() - some_rotation()).norm(), 1e-12);
}

}  // namespace
}  // namespace stylet::physics
