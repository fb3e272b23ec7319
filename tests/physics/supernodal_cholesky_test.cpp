// Large factors: the numbers are CHOLMOD's, whoever makes them and with whatever vectors.
#include "physics/tissue/companion.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/dense_tiles.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/tissue_model.h"
#include "tests/support/sanitized.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

/// A cube held at its bottom, sheared by a quarter, with separators wider than the panels that columns go in; 100 of
/// its nodes are eliminated last.
struct ShearedCube {
  ShearedCube() {
    for (int n = 0; n < model.node_count(); ++n) positions(0, n) += 0.25 * positions(2, n);
    std::vector<Eigen::Quaterniond> rotations(model.point_count(), Eigen::Quaterniond::Identity());
    update_rotations(model, positions, rotations);
    pattern.assemble(model, rotations, 1, values);
    for (int dof = model.dof_count() / 2; dof < model.dof_count() / 2 + 300; ++dof) trailing.push_back(dof);
  }
  static TetMesh mesh_of() {
    return reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {12, 12, 12});
  }
  /// @param own_from  entries of L
  Factorisation factorised(std::size_t own_from) {
    Factorisation factor(pattern, workspace);
    factor.make_own_from(own_from);
    EXPECT_TRUE(factor.order_last(trailing, pattern, workspace));
    EXPECT_TRUE(factor.factorise(pattern, values, workspace));
    return factor;
  }
  Eigen::MatrixXd compliance(const Factorisation& factor) const {
    const auto size = static_cast<Eigen::Index>(trailing.size());
    Eigen::MatrixXd result(size, size);
    factor.trailing_compliance(result);
    return result;
  }
  Eigen::VectorXd solution(const Factorisation& factor) {
    Eigen::VectorXd b(model.dof_count());
    for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = std::sin(static_cast<double>(i));
    Eigen::VectorXd x(b.size());
    factor.solve(b, x, workspace);
    return x;
  }

  TetMesh mesh = mesh_of();
  TissueModel model{mesh, std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, 0.45}),
                    reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; })};
  Eigen::Matrix3Xd positions = rest_positions(model);
  StiffnessPattern pattern{model};
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  std::vector<int> trailing;
  SolveWorkspace workspace;
};

constexpr std::size_t kAlways = 0;
constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

TEST(DenseTiles, EachEntryIsOneChainOfFusedMultiplyAddsWhateverTheVectors) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const int depth : {1, 5, 192}) {
    std::vector<double> a(static_cast<std::size_t>(kStripRows) * depth);
    std::vector<double> b(static_cast<std::size_t>(kStripColumns) * depth);
    for (double& value : a) value = uniform(random);
    for (double& value : b) value = uniform(random);
    std::vector<double> expected(static_cast<std::size_t>(kStripRows) * kStripColumns, 0);
    for (int j = 0; j < kStripColumns; ++j) {
      for (int i = 0; i < kStripRows; ++i) {
        double& sum = expected[static_cast<std::size_t>(j) * kStripRows + i];
        for (int k = 0; k < depth; ++k) {
          sum = std::fma(a[static_cast<std::size_t>(k) * kStripRows + i],
                         b[static_cast<std::size_t>(k) * kStripColumns + j], sum);
        }
      }
    }
    for (const TileProduct product : {tile_product_avx2(), tile_product_avx512()}) {
      if (product == nullptr) continue;  // a processor without AVX-512
      std::vector<double> out(expected.size(), 1);
      product(depth, a.data(), b.data(), out.data());
      EXPECT_EQ(out, expected) << depth;
    }
  }
}

TEST(SupernodalCholesky, LiesWhereTheLastOneDidWhateverItsTrailingDofs) {
  ShearedCube cube;
  Factorisation factor = cube.factorised(kAlways);
  const std::vector<int> first = cube.trailing;
  for (const int count : {150, 300, 30, 290, 0}) {
    cube.trailing.assign(first.begin(), first.begin() + count);
    ASSERT_TRUE(factor.order_last(cube.trailing, cube.pattern, cube.workspace));
    ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
    const Factorisation fresh = cube.factorised(kAlways);
    EXPECT_EQ(cube.compliance(factor), cube.compliance(fresh)) << count;
    EXPECT_EQ(cube.solution(factor), cube.solution(fresh)) << count;
    const Factorisation copy(factor);
    EXPECT_EQ(cube.solution(copy), cube.solution(fresh)) << count;
  }
}

long minor_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

TEST(SupernodalCholesky, ACopyHasRoomForMoreTrailingDofsThatWasTouchedBefore) {
  ShearedCube cube;
  const std::vector<int> all = std::exchange(cube.trailing, {});
  const Factorisation at_rest = cube.factorised(kAlways);
  Factorisation warm(at_rest);  // the storage of whoever factorises
  ASSERT_TRUE(warm.order_last(all, cube.pattern, cube.workspace));
  ASSERT_TRUE(warm.factorise(cube.pattern, cube.values, cube.workspace));
  Factorisation copy(at_rest);
  const long before = minor_faults();
  ASSERT_TRUE(copy.order_last(all, cube.pattern, cube.workspace));
  ASSERT_TRUE(copy.factorise(cube.pattern, cube.values, cube.workspace));
  const long faults = minor_faults() - before;
  const auto pages = static_cast<long>(copy.factor_nonzeros() * sizeof(double) / 4096);
  std::printf("  %ld pages of L, %ld touched for the first time\n", pages, faults);
  EXPECT_GT(copy.factor_nonzeros(), at_rest.factor_nonzeros());
  // A sanitizer's allocator takes fresh memory where the C library's goes on with what it has.
  if (!support::kSanitized) {
    EXPECT_LT(faults, pages / 2);
  }
  cube.trailing = all;
  EXPECT_EQ(cube.solution(copy), cube.solution(cube.factorised(kAlways)));
}

TEST(SupernodalCholesky, SolvesAsCholmodDoesAndGivesTheSameComplianceOfTheCorridor) {
  ShearedCube cube;
  const Factorisation own = cube.factorised(kAlways);
  const Factorisation cholmod = cube.factorised(kNever);
  const Eigen::VectorXd x = cube.solution(cholmod);
  EXPECT_LE((cube.solution(own) - x).norm(), 1e-12 * x.norm());
  const Eigen::MatrixXd compliance = cube.compliance(cholmod);
  EXPECT_LE((cube.compliance(own) - compliance).norm(), 1e-12 * compliance.norm());
  EXPECT_FALSE(cube.compliance(own) == compliance);  // it was another who made it
}

TEST(SupernodalCholesky, GivesTheSameBitsWithOneThreadAndTwoAndAgainInTheSameStorage) {
  ShearedCube cube;
  Factorisation factor = cube.factorised(kAlways);
  const Eigen::MatrixXd compliance = cube.compliance(factor);
  const Eigen::VectorXd x = cube.solution(factor);
  Companion companion;
  cube.workspace.companion = &companion;
  for (int again = 0; again < 5; ++again) {
    ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
    EXPECT_TRUE(cube.compliance(factor) == compliance);
    EXPECT_TRUE(cube.solution(factor) == x);
  }
}

TEST(SupernodalCholesky, RefusesAMatrixThatIsNotPositiveDefiniteAndGoesOnWithOneThatIs) {
  ShearedCube cube;
  Factorisation factor = cube.factorised(kAlways);
  const Eigen::VectorXd x = cube.solution(factor);
  for (const int column : {0, cube.model.dof_count() / 2, cube.model.dof_count() - 1}) {
    std::vector<double> indefinite = cube.values;
    indefinite[cube.pattern.column_start()[column]] = -1;
    EXPECT_FALSE(factor.factorise(cube.pattern, indefinite, cube.workspace)) << column;
  }
  ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
  EXPECT_TRUE(cube.solution(factor) == x);
}

}  // namespace
}  // namespace stylet::physics
