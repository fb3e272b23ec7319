// Block-tridiagonal factorisation (its solves: tests/validation) and the Needle that is built on it.
#include "physics/needle/block_tridiagonal.h"
#include "physics/needle/needle.h"
#include "physics/needle/rotation_vector.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

struct Dense {
  MatrixXd a;
  BlockTridiagonal system;
};

Dense random_system(int blocks, unsigned seed) {
  std::srand(seed);
  Dense result{MatrixXd::Zero(6 * blocks, 6 * blocks), BlockTridiagonal(blocks)};
  MatrixXd l = MatrixXd::Zero(6 * blocks, 6 * blocks);  // A = L L^T with a block-bidiagonal L is block-tridiagonal
  for (int i = 0; i < blocks; ++i) {
    l.block<6, 6>(6 * i, 6 * i) = MatrixXd::Random(6, 6) + 3 * MatrixXd::Identity(6, 6);
    if (i > 0) l.block<6, 6>(6 * i, 6 * (i - 1)) = MatrixXd::Random(6, 6);
  }
  result.a = reference::product(l, l.transpose());
  for (int i = 0; i < blocks; ++i) {
    result.system.diagonal(i) = result.a.block<6, 6>(6 * i, 6 * i);
    if (i + 1 < blocks) result.system.upper(i) = result.a.block<6, 6>(6 * i, 6 * (i + 1));
  }
  return result;
}

TEST(BlockTridiagonal, ForwardSolvesGiveTheCompliance) {
  for (int blocks : {1, 9, 65}) {
    Dense d = random_system(blocks, 6);
    ASSERT_TRUE(d.system.factorise());
    const int columns = 13, stride = 20;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    RowMajor y = RowMajor::Constant(6 * blocks, stride, 7.0);
    // The last columns begin further down.
    MatrixXd b = MatrixXd::Random(6 * blocks, columns);
    std::vector<int> reached(static_cast<std::size_t>(blocks));
    for (int i = 0; i < blocks; ++i) {
      reached[i] = std::min(columns, 5 + i);
      b.block(6 * i, 0, 6, columns).rightCols(columns - reached[i]).setZero();
    }
    y.leftCols(columns) = b;
    d.system.forward_solve(y.data(), reached, stride);
    const MatrixXd w = reference::product(MatrixXd(y.leftCols(columns)).transpose(), MatrixXd(y.leftCols(columns)));
    const MatrixXd exact = reference::product(b.transpose(), reference::solve(d.a, b));
    EXPECT_LT((w - exact).norm(), 1e-12 * exact.norm());
    EXPECT_EQ((y.rightCols(stride - columns).array() - 7.0).abs().maxCoeff(), 0) << "wrote beyond its columns";
  }
}

TEST(BlockTridiagonal, RefusesWhatIsNotPositiveDefinite) {
  Dense d = random_system(5, 7);
  d.system.diagonal(3) -= 100 * BlockTridiagonal::Block::Identity();
  EXPECT_FALSE(d.system.factorise());
  Dense n = random_system(5, 7);
  n.system.diagonal(2)(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(n.system.factorise());
}

StylusPose oblique_hub() {
  return {Vector3d(0.3, -0.2, 0.1), Eigen::Quaterniond(Eigen::AngleAxisd(0.9, Vector3d(1, 2, -1).normalized()))};
}

TEST(Needle, HangsStraightWithoutForceWhateverItsPose) {
  const NeedleProperties properties;
  const NeedleShape shape = straight_needle(properties, oblique_hub());
  Needle needle(properties, {});
  ASSERT_TRUE(needle.linearise(shape, oblique_hub(), 1e-3));
  VectorXd zero = VectorXd::Zero(6 * needle.node_count()), x = zero;
  needle.solve(zero, x);
  EXPECT_LT(x.norm(), 1e-13);
  EXPECT_NEAR((shape.nodes().rightCols<1>() - shape.nodes().leftCols<1>()).norm(), properties.length, 1e-15);
}

TEST(Needle, TipLoadGivesTimoshenkoDeflectionAndReaction) {
  const NeedleProperties p;
  const StylusPose hub = oblique_hub();
  const NeedleShape shape = straight_needle(p, hub);
  Needle needle(p, {});
  ASSERT_TRUE(needle.linearise(shape, hub, 1e-3));
  const Vector3d x_axis = hub.orientation * Vector3d::UnitX();
  const Vector3d y_axis = hub.orientation * Vector3d::UnitY();
  VectorXd load = VectorXd::Zero(6 * needle.node_count()), motion = load;
  load.segment<3>(6 * 8) = 0.01 * x_axis;
  needle.solve(load, motion);
  const SectionStiffness s = tube_section(p.outer_diameter, p.inner_diameter, p.young_modulus, p.poisson_ratio);
  const double exact = 0.01 * (std::pow(p.length, 3) / (3 * s.bending) + p.length / s.shear);
  EXPECT_NEAR(motion.segment<3>(48).dot(x_axis) / exact, 1, 1e-10);
  const Vector6d reaction = needle.base_reaction(load, motion);
  EXPECT_LT((reaction.head<3>() + 0.01 * x_axis).norm(), 1e-10);
  EXPECT_LT((reaction.tail<3>() + 0.01 * p.length * y_axis).norm(), 1e-10);  // z x x = y
}

TEST(Needle, FactorMatchesDenseAssembly) {
  const NeedleProperties p;
  const StylusPose hub = oblique_hub();
  NeedleShape shape = straight_needle(p, hub);
  std::srand(3);
  VectorXd bend = VectorXd::Zero(54);
  bend.tail(48) = 0.002 * VectorXd::Random(48);
  for (int i = 0; i < 9; ++i) bend.segment<3>(6 * i) *= 1e-6;  // metres: less than the buckling strain
  move(shape, bend);
  Needle needle(p, {});
  ASSERT_TRUE(needle.linearise(shape, hub, 1e-3));

  MatrixXd k = MatrixXd::Zero(54, 54);
  VectorXd f = VectorXd::Zero(54);
  Beam beam;
  beam.length = p.length / 8;
  beam.rest_frame << Vector3d::UnitZ(), Vector3d::UnitX(), Vector3d::UnitY();
  beam.section = tube_section(p.outer_diameter, p.inner_diameter, p.young_modulus, p.poisson_ratio);
  for (int i = 0; i < 8; ++i) {
    const BeamResponse r = beam_response(beam, {shape.positions.col(i), shape.orientation(i).toRotationMatrix()},
                                         {shape.positions.col(i + 1), shape.orientation(i + 1).toRotationMatrix()});
    k.block<12, 12>(6 * i, 6 * i) += r.tangent;
    f.segment<12>(6 * i) += r.force;
  }
  const VectorXd load = VectorXd::Random(54);
  VectorXd motion(54);
  needle.solve(load, motion);
  const VectorXd exact = reference::solve(k.bottomRightCorner(48, 48), (load - f).tail(48));
  std::printf("relative difference %.1e\n", (motion.tail(48) - exact).norm() / exact.norm());
  EXPECT_LT((motion.tail(48) - exact).norm(), 1e-9 * exact.norm());  // condition of A_n is about 1e9
  EXPECT_EQ(motion.head(6).norm(), 0);
}

TEST(Needle, BuckledStateIsStillSolved) {
  const NeedleProperties p;
  NeedleShape shape = straight_needle(p, {});
  shape.positions.row(2) *= 0.99;  // 1 % of compression: 1430 N, hundreds of times the buckling load
  Needle needle(p, {});
  ASSERT_TRUE(needle.linearise(shape, {}, 1e-3));
  VectorXd zero = VectorXd::Zero(54), x = zero;
  needle.solve(zero, x);
  EXPECT_NEAR(x[50], 0.01 * p.length, 1e-6 * p.length) << "the tip springs back along the axis";
}

TEST(Needle, RefusesImpossibleProperties) {
  EXPECT_THROW(Needle({.length = -1}, {}), std::invalid_argument);
  EXPECT_THROW(Needle({.inner_diameter = 2e-3}, {}), std::invalid_argument);
  EXPECT_THROW(Needle({.beams = 65}, {}), std::invalid_argument);
  EXPECT_THROW(Needle({.poisson_ratio = 0.5}, {}), std::invalid_argument);
  EXPECT_THROW(Needle({}, {.kind = BaseKind::spring_damper, .stiffness = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace stylet::physics
