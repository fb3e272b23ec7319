// The block-tridiagonal solver against dense Cholesky, on systems of needles and on random ones.
#include "physics/needle/block_tridiagonal.h"

#include "physics/needle/beam.h"
#include "physics/needle/section.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using validation::report_residual;

BlockTridiagonal blocks_of(const MatrixXd& a) {
  const int count = static_cast<int>(a.rows()) / 6;
  BlockTridiagonal system(count);
  for (int i = 0; i < count; ++i) {
    system.diagonal(i) = a.block<6, 6>(6 * i, 6 * i);
    if (i + 1 < count) system.upper(i) = a.block<6, 6>(6 * i, 6 * (i + 1));
  }
  return system;
}

/// Stiffness of a straight clamped needle of gauge 18, 150 mm, first node left out: condition about 1e9 and more.
MatrixXd clamped_needle(int beams) {
  const double length = 0.150 / beams;
  const Beam beam{.length = length,
                  .rest_frame = Eigen::Matrix3d::Identity(),
                  .section = tube_section(1.27e-3, 0.838e-3, 200e9, 0.3)};
  const BeamEnd a{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  const BeamEnd b{length * Eigen::Vector3d::UnitX(), Eigen::Matrix3d::Identity()};
  const Matrix12d element = beam_response(beam, a, b).tangent;
  MatrixXd k = MatrixXd::Zero(6 * (beams + 1), 6 * (beams + 1));
  for (int i = 0; i < beams; ++i) k.block<12, 12>(6 * i, 6 * i) += element;
  return k.bottomRightCorner(6 * beams, 6 * beams);
}

/// B B^T + I with a block-bidiagonal B: well conditioned, no structure beyond its band.
MatrixXd random_system(int blocks) {
  std::srand(11);
  MatrixXd b = MatrixXd::Zero(6 * blocks, 6 * blocks);
  for (int i = 0; i < blocks; ++i) {
    b.block<6, 6>(6 * i, 6 * i).setRandom();
    if (i > 0) b.block<6, 6>(6 * i, 6 * (i - 1)).setRandom();
  }
  return reference::product(b, b.transpose()) + MatrixXd::Identity(6 * blocks, 6 * blocks);
}

TEST(BlockTridiagonal, AgreesWithDenseCholeskyOnRandomSystems) {
  double worst = 0;
  for (const int blocks : {1, 2, 3, 8, 16, 33, 64, 65}) {
    const MatrixXd a = random_system(blocks);
    BlockTridiagonal system = blocks_of(a);
    ASSERT_TRUE(system.factorise());
    for (int i = 0; i < 10; ++i) {
      const VectorXd b = VectorXd::Random(6 * blocks);
      VectorXd x = b;
      system.solve(x);
      const VectorXd dense = reference::solve(a, b);
      worst = std::max(worst, (x - dense).norm() / dense.norm());
    }
  }
  report_residual("|x - dense LU| / |x|, random systems", worst, 1e-12);
}

// Two faultless solvers differ on an ill-conditioned system by its condition times the rounding, so for needles the
// claim is one that does not depend on it: the residual |b - A x|_i over sqrt(a_ii) sum_j sqrt(a_jj) |x_j| of a
// Cholesky solve is a few roundings. A formed inverse leaves the condition in it: that is how this test knows of
// none.
TEST(BlockTridiagonal, SolvesNeedlesBackwardStablyAsNoInverseDoes) {
  double worst = 0, worst_of_inverse = 0;
  for (const int beams : {4, 8, 32, 64}) {
    const MatrixXd a = clamped_needle(beams);
    const VectorXd scale = a.diagonal().cwiseSqrt();
    const auto backward_error = [&](const VectorXd& b, const VectorXd& x) {
      return ((b - a * x).cwiseQuotient(scale) / scale.cwiseProduct(x).lpNorm<1>()).lpNorm<Eigen::Infinity>();
    };
    BlockTridiagonal system = blocks_of(a);
    ASSERT_TRUE(system.factorise());
    const MatrixXd inverse = reference::inverse(a);
    for (int i = 0; i < 10; ++i) {
      const VectorXd b = a * VectorXd::Random(6 * beams).cwiseQuotient(scale);
      VectorXd x = b;
      system.solve(x);
      worst = std::max(worst, backward_error(b, x));
      worst_of_inverse = std::max(worst_of_inverse, backward_error(b, inverse * b));
    }
  }
  report_residual("backward error, needles of 4 to 64 beams", worst, 1e-15);
  std::printf("  the same through a dense inverse: %.1e\n", worst_of_inverse);
  EXPECT_GT(worst_of_inverse, 1e-13) << "the test no longer tells a factorisation from an inverse";
}

// The compliance W = H A^-1 H^T is what the needle gives to the contact system. Its condition grows with the fourth
// power of the number of beams, and with it the rounding that dense Cholesky leaves as well: 1e-12 is asked of
// needles as they are used, up to 8 beams, and what rounding allows of the largest.
TEST(BlockTridiagonal, ComplianceOfNeedlesAgreesWithDenseCholesky) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const auto& [beams, bound] : {std::pair{4, 1e-12}, {8, 1e-12}, {64, 1e-9}}) {
    const MatrixXd a = clamped_needle(beams);
    BlockTridiagonal system = blocks_of(a);
    ASSERT_TRUE(system.factorise());
    MatrixXd h = MatrixXd::Zero(6 * beams, 16);  // columns of H^T across the shaft, as contacts make them
    for (int c = 0; c < 16; ++c) {
      const int node = c / 2 * (beams - 1) / 8;
      h(6 * node + 1 + c % 2, c) = 0.3;
      h(6 * node + 7 + c % 2, c) = 0.7;
    }
    RowMajor y = h;
    system.forward_solve(y.data(), std::vector<int>(static_cast<std::size_t>(beams), 16), 16);
    const MatrixXd w = reference::product(y.transpose(), y);
    const MatrixXd dense = reference::product(h.transpose(), reference::solve(a, h));
    report_residual("|W - dense| / |W|, " + std::to_string(beams) + " beams", (w - dense).norm() / dense.norm(),
                    bound);
  }
}

}  // namespace
}  // namespace stylet::physics
