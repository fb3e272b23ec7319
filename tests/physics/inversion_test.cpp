// Tetrahedra squeezed flat: the barrier's energy, forces and stiffness, and the length of steps.
#include "physics/tissue/inversion.h"
#include "physics/tissue/lanes.h"

#include "physics/tissue/corotational.h"
#include "physics/tissue/stiffness.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <random>
#include <vector>

namespace stylet::physics {
namespace {

/// One cell held at its foot.
TissueModel cell() {
  const TetMesh mesh = reference::kuhn_box({0, 0, 0}, {0.01, 0.01, 0.01}, {1, 1, 1});
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {10e3, 0.45});
  return {mesh, materials, reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; })};
}

/// Pressed to `share` of its height and a little sheared.
Eigen::Matrix3Xd pressed(const TissueModel& model, double share) {
  Eigen::Matrix3Xd x = rest_positions(model);
  x.row(0) += 0.2 * x.row(2);
  x.row(2) *= share;
  return x;
}

TEST(Inversion, TheBarrierBeginsSmoothlyAndGrowsWithoutBound) {
  const TetRest rest{.gradients = {}, .volume = 1, .lambda = 9e3, .mu = 1e3};
  EXPECT_EQ(barrier(rest, kSqueezed).energy, 0);
  EXPECT_EQ(barrier(rest, 1).slope, 0);
  const Barrier start = barrier(rest, kSqueezed * (1 - 1e-6));
  EXPECT_LT(start.curvature, 1e-4 * rest.lambda);  // continuous to the second derivative
  EXPECT_GT(barrier(rest, 1e-9).energy, 10 * barrier(rest, 0.1).energy);
  EXPECT_LT(barrier(rest, 1e-9).slope, 1e6 * barrier(rest, 0.1).slope);
  for (const double j : {0.34, 0.2, 0.05, 0.001}) {
    const double h = 1e-5 * j;
    const Barrier at = barrier(rest, j), above = barrier(rest, j + h), below = barrier(rest, j - h);
    EXPECT_NEAR((above.energy - below.energy) / (2 * h), at.slope, 1e-6 * std::abs(at.slope) + 1e-3);
    EXPECT_NEAR((above.slope - below.slope) / (2 * h), at.curvature, 1e-6 * at.curvature + 1e-2);
    EXPECT_LT(at.slope, 0);
    EXPECT_GT(at.curvature, 0);
  }
}

TEST(Inversion, ForcesAreTheGradientOfTheEnergyInTheBarrierToo) {
  const TissueModel model = cell();
  Eigen::Matrix3Xd x = pressed(model, 0.15);
  std::vector<Eigen::Quaterniond> rotations(model.tets.size(), Eigen::Quaterniond::Identity());
  const auto energy = [&] {
    update_rotations(model, x, rotations);
    return elastic_energy(model, x, rotations);
  };
  Eigen::Matrix3Xd forces(3, model.node_count());
  update_rotations(model, x, rotations);
  EXPECT_EQ(internal_forces(model, x, rotations, forces), model.tet_count());
  const double h = 1e-8;
  for (int n = 0; n < model.node_count(); ++n) {
    for (int c = 0; c < 3; ++c) {
      const double at = x(c, n);
      x(c, n) = at + h;
      const double above = energy();
      x(c, n) = at - h;
      const double below = energy();
      x(c, n) = at;
      EXPECT_NEAR((above - below) / (2 * h), forces(c, n), 1e-5 * forces.norm());
    }
  }
}

TEST(Inversion, SqueezedTetrahedraAddToTheStiffnessAndKeepItPositiveDefinite) {
  const TissueModel model = cell();
  const StiffnessPattern pattern(model);
  std::vector<Eigen::Quaterniond> rotations(model.tets.size(), Eigen::Quaterniond::Identity());
  const auto dense = [&](double share) {
    const Eigen::Matrix3Xd x = pressed(model, share);
    update_rotations(model, x, rotations);
    std::vector<SqueezedTet> squeezed;
    find_squeezed(model, x, {}, squeezed);
    std::vector<double> values(pattern.nonzeros());
    std::vector<double> without(pattern.nonzeros());
    pattern.assemble(model, rotations, 1, values, squeezed);
    pattern.assemble(model, rotations, 1, without);
    Eigen::MatrixXd both[2];
    for (int k = 0; k < 2; ++k) {
      both[k].setZero(model.dof_count(), model.dof_count());
      for (int j = 0; j < model.dof_count(); ++j) {
        for (int i = pattern.column_start()[j]; i < pattern.column_start()[j + 1]; ++i) {
          both[k](pattern.rows()[i], j) = both[k](j, pattern.rows()[i]) = k == 0 ? values[i] : without[i];
        }
      }
    }
    return std::pair<Eigen::MatrixXd, Eigen::MatrixXd>(both[0], both[0] - both[1]);
  };
  EXPECT_EQ(dense(0.5).second.norm(), 0);  // not squeezed
  const auto [stiffness, added] = dense(0.1);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> of_added(added);
  EXPECT_GT(of_added.eigenvalues().maxCoeff(), 0);
  EXPECT_GT(of_added.eigenvalues().minCoeff(), -1e-10 * of_added.eigenvalues().maxCoeff());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness).eigenvalues().minCoeff(), 0);
}

TEST(Inversion, AStepEndsWhereTheFirstTetrahedronHasThreeTenthsOfItsVolumeLeft) {
  const TissueModel model = cell();
  const Eigen::Matrix3Xd before = rest_positions(model);
  // Height 1 - t along the way: linear in t.
  EXPECT_NEAR(uninverted_fraction(model, before, pressed(model, 0)), 0.7, 1e-5);
  EXPECT_NEAR(uninverted_fraction(model, before, pressed(model, -1)), 0.35, 1e-5);
  EXPECT_EQ(uninverted_fraction(model, before, pressed(model, 0.31)), 1);
  // Shrunk through a point and out again, mirrored: (1 - 2t)^3, which is negative at the end.
  EXPECT_NEAR(uninverted_fraction(model, before, -before), (1 - std::cbrt(0.3)) / 2, 1e-5);
  // Turned by half a turn in a straight line: (1 - 2t)^2, positive again at the end. The cubic sees the way.
  Eigen::Matrix3Xd turned = before;
  turned.topRows<2>() *= -1;
  EXPECT_NEAR(uninverted_fraction(model, before, turned), (1 - std::sqrt(0.3)) / 2, 1e-5);
}

TEST(Inversion, AStepOfFourEndsWhereTheFirstOfThemDoes) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int shortened = 0;
  for (int i = 0; i < 20'000; ++i) {
    LaneMatrix before, change;
    double wanted = i % 2 == 0 ? 1 : 0.6;
    const double given = wanted;
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto any = [&](double size) {
        return Eigen::Matrix3d(Eigen::Matrix3d::NullaryExpr([&] { return size * normal(random); }));
      };
      const Eigen::Matrix3d f = Eigen::Matrix3d::Identity() + any(0.3);  // some are inverted
      const Eigen::Matrix3d g = any(0.15);
      set_lane(f, lane, before);
      set_lane(g, lane, change);
      wanted = uninverted_fraction(f, g, wanted);
    }
    EXPECT_EQ(uninverted_fraction(before, change, given), wanted);
    shortened += wanted < given ? 1 : 0;
  }
  EXPECT_GT(shortened, 1000);
  EXPECT_LT(shortened, 19'000);
}

}  // namespace
}  // namespace stylet::physics
