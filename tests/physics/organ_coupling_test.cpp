// Contacts between bodies at haptic rate, against the problem solved as a whole (README eq. 31b).
#include "physics/contact/organ_coupling.h"
#include "physics/messages/messages.h"

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kNodes = 4;

/// A body of four nodes, one tetrahedron, in contact by `rows` rows: all of one random compliance.
struct Random {
  explicit Random(int rows, unsigned seed) : patch(std::make_unique<TissuePatch>()) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const int n = 3 * kNodes;
    MatrixXd root(n + rows, n + rows + 6);
    for (double& x : root.reshaped()) x = normal(random);
    all = root * root.transpose() / (n + rows);
    patch->epoch = 1;
    patch->body_count = 1;
    patch->bodies[0].node_count = kNodes;
    patch->organs.reserve(1);
    OrganRows& organs = patch->organs;
    organs.count = rows;
    organs.w.topLeftCorner(rows, rows) = all.bottomRightCorner(rows, rows);
    organs.y[0].topLeftCorner(rows, n) = all.bottomLeftCorner(rows, n);
    for (int i = 0; i < rows; ++i) {
      organs.ids[i] = static_cast<std::uint64_t>(i) + 7;
      organs.lambda[i] = std::max(0.0, normal(random));
      organs.gap[i] = normal(random);
    }
  }
  /// lambda by projected Gauss-Seidel, until nothing moves.
  VectorXd reference(const VectorXd& force) const {
    const int rows = patch->organs.count;
    const MatrixXd w = patch->organs.w.topLeftCorner(rows, rows);
    const VectorXd lambda_0 = patch->organs.lambda.head(rows);
    const VectorXd d = patch->organs.gap.head(rows) - w * lambda_0 + all.bottomLeftCorner(rows, 3 * kNodes) * force;
    VectorXd lambda = lambda_0;
    for (int sweep = 0; sweep < 200000; ++sweep) {
      double moved = 0;
      for (int i = 0; i < rows; ++i) {
        const double next = std::max(0.0, lambda[i] - (d[i] + w.row(i).dot(lambda)) / w(i, i));
        moved = std::max(moved, std::abs(next - lambda[i]));
        lambda[i] = next;
      }
      if (moved < 1e-15) break;
    }
    return lambda;
  }
  std::unique_ptr<TissuePatch> patch;
  MatrixXd all;  // compliance of nodes and rows
};

TEST(OrganCoupling, MultipliersAndMotionAreThoseOfTheWholeProblem) {
  double worst_lambda = 0, worst_motion = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const int rows = 1 + static_cast<int>(seed % 13);
    const Random problem(rows, seed);
    OrganCoupling coupling;
    coupling.load(problem.patch->organs);
    std::mt19937 random(seed + 1000);
    std::normal_distribution<double> normal(0, 3);
    PatchContact point;
    point.patch_nodes = {0, 1, 2, 3};
    point.barycentric << 0.1, 0.2, 0.3, 0.4;
    MatrixXd b = MatrixXd::Zero(3, 3 * kNodes);
    for (int k = 0; k < 4; ++k) b.middleCols<3>(3 * k) = point.barycentric[k] * Eigen::Matrix3d::Identity();

    for (int step = 0; step < 5; ++step) {
      const Vector3d f(normal(random), normal(random), normal(random));
      const VectorXd on_nodes = b.transpose() * f;
      MatrixXd y(rows, 3);
      coupling.openings(*problem.patch, 0, point, y);
      coupling.settle(y * f);
      const VectorXd lambda = problem.reference(on_nodes);
      const VectorXd change = lambda - problem.patch->organs.lambda.head(rows);
      worst_lambda = std::max(worst_lambda, (coupling.change() - change).cwiseAbs().maxCoeff());
      // Folded with the rows that now carry force, the point moves as the whole problem says.
      const int carrying = coupling.carrying();
      ASSERT_EQ(carrying, (lambda.array() > 1e-13).count());
      MatrixXd z(carrying, 3);
      coupling.fold(y, z);
      const Vector3d folded = y.transpose() * coupling.free_change() - z.transpose() * (z * f);
      worst_motion = std::max(worst_motion, (folded - y.transpose() * change).cwiseAbs().maxCoeff());
    }
  }
  std::printf("multipliers off by %.1e N, motion by %.1e m\n", worst_lambda, worst_motion);
  EXPECT_LT(worst_lambda, 1e-10);
  EXPECT_LT(worst_motion, 1e-10);
}

TEST(OrganCoupling, RowsThatStayCarryOnWhatTheyDid) {
  // A new patch says what carried force when it was made, which may be long ago; a row known before knows better.
  const Random problem(6, 3);
  OrganCoupling coupling;
  coupling.load(problem.patch->organs);
  coupling.settle(VectorXd::Constant(6, -50.0));  // pressed together: all
  EXPECT_EQ(coupling.carrying(), 6);
  coupling.load(problem.patch->organs);
  EXPECT_EQ(coupling.carrying(), 6);
  problem.patch->organs.ids[2] = 99;  // a new one, which carried nothing
  problem.patch->organs.lambda[2] = 0;
  coupling.load(problem.patch->organs);
  EXPECT_EQ(coupling.carrying(), 5);
}

TEST(OrganCoupling, RowsThatAreNotFiniteAreNone) {
  const Random problem(5, 4);
  problem.patch->organs.gap[1] = std::nan("");
  OrganCoupling coupling;
  coupling.load(problem.patch->organs);
  EXPECT_EQ(coupling.rows(), 0);
  EXPECT_EQ(coupling.carrying(), 0);
  EXPECT_FALSE(coupling.settle(VectorXd(0)));
}

}  // namespace
}  // namespace stylet::physics
