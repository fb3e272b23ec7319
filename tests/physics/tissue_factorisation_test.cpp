// Assembly, factorisation and W_bar against dense linear algebra.
#include "physics/tissue/factorisation.h"

#include "physics/tissue/blas.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/isolated_dofs.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

namespace stylet::physics {
namespace {

/// A jittered cube of two materials, deformed by a random amount, with its dense twin.
struct Cube {
  explicit Cube(int cells = 3) : mesh(make_mesh(cells)), fixed(bottom(mesh)), materials(two_materials(mesh)) {}
  static TetMesh make_mesh(int cells) {
    TetMesh mesh =
        reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
    reference::jitter_inner_nodes(mesh, 0.1 * 0.1 / cells, 7);
    return mesh;
  }
  static std::vector<int> bottom(const TetMesh& mesh) {
    return reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  }
  static std::vector<ElasticMaterial> two_materials(const TetMesh& mesh) {
    std::vector<ElasticMaterial> materials(mesh.tets.size(), {10e3, 0.45});
    for (std::size_t t = 0; t < materials.size() / 2; ++t) materials[t] = {3e3, 0.4};
    return materials;
  }
  void deform(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> shift(-0.004, 0.004);
    positions = rest_positions(model);
    for (int n = 0; n < model.node_count(); ++n) {
      if (model.free_index[n] < 0) continue;
      const double height = positions(2, n);
      positions.col(n) += Eigen::Vector3d(shift(random) + 3 * height * height, shift(random), shift(random));
    }
    update_rotations(model, positions, rotations);
    pattern.assemble(model, rotations, 1, values);
  }

  TetMesh mesh;
  std::vector<int> fixed;
  std::vector<ElasticMaterial> materials;
  TissueModel model{mesh, materials, fixed};
  support::DenseTissue dense{mesh, materials, fixed};
  StiffnessPattern pattern{model};
  std::vector<Eigen::Quaterniond> rotations{model.tets.size(), Eigen::Quaterniond::Identity()};
  Eigen::Matrix3Xd positions = rest_positions(model);
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  SolveWorkspace workspace;
};

Eigen::MatrixXd expand(const StiffnessPattern& pattern, const std::vector<double>& values) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(pattern.dof_count(), pattern.dof_count());
  for (int c = 0; c < pattern.dof_count(); ++c) {
    for (int k = pattern.column_start()[c]; k < pattern.column_start()[std::size_t(c) + 1]; ++k) {
      const int r = pattern.rows()[k];
      a(r, c) = a(c, r) = values[k];
    }
  }
  return a;
}

TEST(Stiffness, AssemblyMatchesDenseTextbookElements) {
  Cube cube;
  cube.deform(1);
  const Eigen::MatrixXd exact = cube.dense.free_stiffness(cube.positions.reshaped());
  const double error =
      (expand(cube.pattern, cube.values) - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff();
  std::printf("  assembly: relative error %.2e\n", error);
  EXPECT_LT(error, 1e-12);
}

TEST(Stiffness, ForcesMatchDenseTextbookElements) {
  Cube cube;
  cube.deform(2);
  Eigen::Matrix3Xd forces(3, cube.model.node_count());
  internal_forces(cube.model, cube.positions, cube.rotations, forces);
  const Eigen::VectorXd exact = cube.dense.forces(cube.positions.reshaped());
  EXPECT_LT((forces.reshaped() - exact).cwiseAbs().maxCoeff(), 1e-12 * exact.cwiseAbs().maxCoeff());
}

TEST(Stiffness, IsSymmetricPositiveDefiniteEvenWhenInverted) {
  Cube cube;
  for (const double amount : {0.0, 0.03, 0.3}) {  // rest, large, turned inside out
    std::mt19937 random(4);
    std::uniform_real_distribution<double> shift(-amount, amount);
    Eigen::Matrix3Xd p = rest_positions(cube.model);
    for (Eigen::Index i = 0; i < p.size(); ++i) p.data()[i] += shift(random);
    update_rotations(cube.model, p, cube.rotations);
    cube.pattern.assemble(cube.model, cube.rotations, 1, cube.values);
    const Eigen::VectorXd eigenvalues = reference::symmetric_eigenvalues(expand(cube.pattern, cube.values));
    std::printf("  moved by %.2f m: eigenvalues %.2e to %.2e N/m\n", amount, eigenvalues.minCoeff(),
                eigenvalues.maxCoeff());
    EXPECT_GT(eigenvalues.minCoeff(), 0);
  }
}

TEST(Factorisation, SolvesAsDenseAlgebraDoes) {
  Cube cube;
  Factorisation factor(cube.pattern, cube.workspace);
  for (unsigned seed = 1; seed < 4; ++seed) {  // again into the same storage
    cube.deform(seed);
    ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
    const Eigen::MatrixXd b = Eigen::MatrixXd::Random(cube.model.dof_count(), 5);
    Eigen::MatrixXd x(b.rows(), b.cols());
    factor.solve(b, x, cube.workspace);
    const Eigen::MatrixXd exact = reference::solve(cube.dense.free_stiffness(cube.positions.reshaped()), b);
    const double error = (x - exact).norm() / exact.norm();
    std::printf("  solve: relative error %.2e\n", error);
    EXPECT_LT(error, 1e-11);
  }
}

TEST(Factorisation, CopyIsIndependent) {
  Cube cube;
  Factorisation factor(cube.pattern, cube.workspace);
  cube.deform(1);
  ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
  const Factorisation copy(factor);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(cube.model.dof_count(), 1);
  Eigen::MatrixXd before(b.rows(), 1);
  Eigen::MatrixXd after(b.rows(), 1);
  copy.solve(b, before, cube.workspace);
  cube.deform(2);
  ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
  copy.solve(b, after, cube.workspace);
  EXPECT_EQ(before, after);
}

TEST(Factorisation, RefusesWhatIsNotPositiveDefiniteOrNotFinite) {
  Cube cube;
  cube.deform(1);
  Factorisation factor(cube.pattern, cube.workspace);
  auto values = cube.values;
  values[0] = -values[0];
  EXPECT_FALSE(factor.factorise(cube.pattern, values, cube.workspace));
  values[0] = std::nan("");
  EXPECT_FALSE(factor.factorise(cube.pattern, values, cube.workspace));
  EXPECT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));  // and recovers
}

TEST(IsolatedDofs, IncrementalUpdatesMatchDenseInverse) {
  // Nodes come and go at random, factors change at random, the cache overflows and is compacted: W_bar is always the
  // block of the dense inverse.
  Cube cube;
  Factorisation factor(cube.pattern, cube.workspace);
  constexpr int kCapacity = 20;
  IsolatedDofs isolated(cube.model.node_count(), kCapacity);
  std::mt19937 random(9);
  std::vector<int> nodes;
  Eigen::MatrixXd inverse;
  Eigen::MatrixXd w_bar(3 * kCapacity, 3 * kCapacity);
  double worst = 0;
  int computed = 0;
  int wanted = 0;
  for (int step = 0; step < 200; ++step) {
    if (step % 23 == 0) {
      cube.deform(unsigned(step));
      ASSERT_TRUE(factor.factorise(cube.pattern, cube.values, cube.workspace));
      inverse = reference::inverse(cube.dense.free_stiffness(cube.positions.reshaped()));
      isolated.clear();
    }
    for (int k = 0; k < 2; ++k) {
      if (nodes.size() > 3 && (random() % 2 == 0 || nodes.size() > 15)) {
        nodes.erase(nodes.begin() + long(random() % nodes.size()));
      } else {
        const int node = int(random() % unsigned(cube.model.node_count()));  // fixed ones too
        if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
      }
    }
    computed += isolated.isolate(nodes, cube.model, factor, cube.workspace);
    wanted += int(nodes.size());
    const auto n = Eigen::Index(3 * nodes.size());
    isolated.gather(nodes, w_bar);
    Eigen::MatrixXd exact = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        const int i = cube.model.free_index[nodes[a]];
        const int j = cube.model.free_index[nodes[b]];
        if (i >= 0 && j >= 0) {
          exact.block<3, 3>(3 * Eigen::Index(a), 3 * Eigen::Index(b)) = inverse.block<3, 3>(3 * i, 3 * j);
        }
      }
    }
    const Eigen::MatrixXd block = w_bar.topLeftCorner(n, n);
    ASSERT_EQ(block, block.transpose()) << "exactly symmetric";
    worst = std::max(worst, (block - exact).norm() / std::max(exact.norm(), 1e-300));
  }
  std::printf("  W_bar: largest relative error %.2e; %d of %d nodes had to be computed\n", worst, computed, wanted);
  EXPECT_LT(worst, 1e-12);
  EXPECT_LT(computed, wanted / 3);  // otherwise nothing is incremental
}

TEST(Blas, NameOfTheLibraryIsKnown) {
  const BlasLibrary& blas = single_threaded_blas();
  std::printf("  BLAS: %s%s\n", blas.name.c_str(), blas.slow_reference ? " (slow)" : "");
  EXPECT_FALSE(blas.name.empty());
}

}  // namespace
}  // namespace stylet::physics
