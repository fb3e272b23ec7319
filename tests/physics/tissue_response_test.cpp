// What spares the simulation step its solves: single precision, nodes prepared ahead of the tip.
#include "physics/contact/insertion_path.h"
#include "physics/tissue/factorisation.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stylet::physics {
namespace {

struct FactorisedCube {
  static TetMesh make_mesh() {
    TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {4, 4, 4});
    reference::jitter_inner_nodes(mesh, 0.0025, 3);
    return mesh;
  }
  FactorisedCube() {
    std::vector<double> values(pattern.nonzeros());
    const std::vector<Eigen::Quaterniond> rest(model.tets.size(), Eigen::Quaterniond::Identity());
    pattern.assemble(model, rest, 1, values);
    EXPECT_TRUE(factor.factorise(pattern, values, workspace));
    const support::DenseTissue dense(mesh, materials, fixed);
    inverse = reference::inverse(dense.free_stiffness(dense.rest()));
  }
  TetMesh mesh = make_mesh();
  std::vector<int> fixed = reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  std::vector<ElasticMaterial> materials = std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, 0.45});
  TissueModel model{mesh, materials, fixed};
  StiffnessPattern pattern{model};
  SolveWorkspace workspace;
  Factorisation factor{pattern, workspace};
  Eigen::MatrixXd inverse;
};

TEST(Factorisation, SinglePrecisionSolveIsRightToSinglePrecision) {
  FactorisedCube cube;
  for (const double size : {1.0, 1e-60, 1e60}) {  // beyond the range of a float: it is scaled
    const Eigen::VectorXd b = size * Eigen::VectorXd::Random(cube.model.dof_count());
    const Eigen::VectorXd exact = cube.inverse * b;
    Eigen::VectorXd x = b;
    cube.factor.solve_nearly(x, x, cube.workspace);  // in place
    const double error = (x - exact).norm() / exact.norm();
    std::printf("  solve of %.0e N in single precision: relative error %.1e\n", size, error);
    EXPECT_LT(error, 1e-4);  // float's 6e-8 times a condition of about 1e3
    EXPECT_GT(error, 1e-10) << "in double after all: twice the bytes";
  }
  Eigen::VectorXd x = Eigen::VectorXd::Ones(cube.model.dof_count());
  cube.factor.solve_nearly(Eigen::VectorXd::Zero(x.size()), x, cube.workspace);
  EXPECT_EQ(x.cwiseAbs().maxCoeff(), 0);
  Eigen::VectorXd bad = Eigen::VectorXd::Ones(x.size());
  bad[5] = std::numeric_limits<double>::quiet_NaN();
  cube.factor.solve_nearly(bad, x, cube.workspace);
  EXPECT_FALSE(x.allFinite()) << "a bad number stays visible";
}

NeedleState needle_to(const Eigen::Vector3d& tip, const Eigen::Vector3d& axis) {
  NeedleState needle;
  needle.node_count = 3;
  for (int i = 0; i < 3; ++i) needle.positions.col(i) = tip - 0.1 * (2 - i) * axis;
  return needle;
}

TEST(InsertionPath, NodesAheadAreThoseOfTheContactsLaidNext) {
  const FactorisedCube cube;
  const std::array<Eigen::Matrix3Xd, 1> positions{rest_positions(cube.model)};
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.1, 0.05).normalized();
  const Eigen::Vector3d off = Eigen::Vector3d(0, 0.001, -0.001);  // bent aside by 1.4 mm: still foreseen
  for (const double tip : {-0.01, 0.004, 0.023}) {                // before and after the entry
    InsertionPath path({&cube.model, 1}, {.spacing = 0.01});
    const Eigen::Vector3d start(0, 0.04, 0.05);
    const NeedleState now = needle_to(start + tip * axis, axis);
    path.update(now, positions);
    const std::vector<int> before = path.isolated_nodes(0);
    const std::vector<int> ahead = path.nodes_ahead(0, now, positions[0], 0.04);
    for (const int node : ahead) EXPECT_EQ(std::count(before.begin(), before.end(), node), 0);
    EXPECT_LT(ahead.size(), 48U) << "a few tetrahedra, not the whole body";
    path.update(needle_to(start + off + (tip + 0.038) * axis, axis), positions);
    ASSERT_GT(path.isolated_nodes(0).size(), before.size());
    int missing = 0;
    for (const int node : path.isolated_nodes(0)) {
      missing += std::count(ahead.begin(), ahead.end(), node) + std::count(before.begin(), before.end(), node) == 0;
    }
    EXPECT_EQ(missing, 0) << "tip at " << tip;
  }
  InsertionPath path({&cube.model, 1}, {.spacing = 0.01});
  const NeedleState away = needle_to({-0.05, 0.05, 0.05}, Eigen::Vector3d::UnitX());
  EXPECT_TRUE(path.nodes_ahead(0, away, positions[0], 0.04).empty());
}

}  // namespace
}  // namespace stylet::physics
