// The corridor eliminated last: W_bar from the trailing block of the factor, solves in halves, nodes outside.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/isolated_dofs.h"
#include "physics/tissue/supernodes.h"
#include "physics/tissue/triangular_inverse.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <set>
#include <vector>

namespace stylet::physics {
namespace {

/// A jittered cube held at its bottom.
struct JitteredCube {
  static TetMesh make_mesh(int cells) {
    TetMesh mesh =
        reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
    reference::jitter_inner_nodes(mesh, 0.01 / cells, 3);
    return mesh;
  }
  explicit JitteredCube(int cells) : mesh(make_mesh(cells)) {
    const std::vector<Eigen::Quaterniond> rest(model.tets.size(), Eigen::Quaterniond::Identity());
    pattern.assemble(model, rest, 1, values);
  }
  Eigen::MatrixXd dense_inverse() const {
    const support::DenseTissue dense(mesh, materials, fixed);
    return reference::inverse(dense.free_stiffness(dense.rest()));
  }
  std::vector<int> dofs(const std::vector<int>& nodes) const {
    std::vector<int> result;
    for (const int node : nodes) {
      for (int c = 0; c < 3; ++c) result.push_back(3 * model.free_index[node] + c);
    }
    return result;
  }
  void factorise(const std::vector<int>& trailing_nodes) {
    ASSERT_TRUE(factor.order_last(dofs(trailing_nodes), pattern, workspace));
    ASSERT_TRUE(factor.factorise(pattern, values, workspace));
  }
  /// Free nodes where `inside` holds.
  template <typename Inside>
  std::vector<int> nodes_where(const Inside& inside) const {
    return reference::nodes_where(mesh, [&](const Eigen::Vector3d& x) { return x.z() > 1e-9 && inside(x); });
  }

  TetMesh mesh;
  std::vector<int> fixed = reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  std::vector<ElasticMaterial> materials = std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, 0.45});
  TissueModel model{mesh, materials, fixed};
  StiffnessPattern pattern{model};
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  SolveWorkspace workspace;
  Factorisation factor{pattern, workspace};
};

double relative(const Eigen::MatrixXd& x, const Eigen::MatrixXd& exact) {
  return (x - exact).norm() / exact.norm();
}

TEST(TriangularInverse, TimesTheFactorIsTheIdentity) {
  for (const int n : {0, 1, 47, 48, 49, 200}) {
    Eigen::MatrixXd l = Eigen::MatrixXd::Random(n, n).triangularView<Eigen::Lower>();
    l.diagonal().array() += 20;
    Eigen::MatrixXd inverse = l;
    invert_lower_triangle(inverse);
    EXPECT_LE((reference::product(l, inverse) - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-13 * n);
    Eigen::MatrixXd product = inverse;
    multiply_by_own_transpose(product);
    EXPECT_EQ(product, Eigen::MatrixXd(product.transpose()));
    EXPECT_LE((product - reference::product(inverse.transpose(), inverse)).norm(), 1e-15 * n);
  }
}

TEST(Factorisation, TrailingComplianceIsTheBlockOfTheDenseInverse) {
  // Also where the trailing nodes cut the rest in two, or leave only a node of it.
  JitteredCube cube(4);
  const Eigen::MatrixXd inverse = cube.dense_inverse();
  const auto near = [](double a, double b) { return std::abs(a - b) < 0.013; };
  std::vector<std::vector<int>> sets{
      {},
      cube.nodes_where([&](const Eigen::Vector3d& x) { return near(x.y(), 0.05) && near(x.z(), 0.05); }),
      cube.nodes_where([&](const Eigen::Vector3d& x) { return near(x.x(), 0.05); }),
      cube.nodes_where([&](const Eigen::Vector3d& x) { return x.norm() > 0.03; }),
  };
  std::reverse(sets[2].begin(), sets[2].end());  // the order is the caller's
  for (const std::vector<int>& nodes : sets) {
    cube.factorise(nodes);
    const std::vector<int> dofs = cube.dofs(nodes);
    ASSERT_TRUE(std::equal(dofs.begin(), dofs.end(), cube.factor.trailing().begin(), cube.factor.trailing().end()));
    Eigen::MatrixXd compliance(dofs.size(), dofs.size());
    cube.factor.trailing_compliance(compliance);
    EXPECT_EQ(compliance, Eigen::MatrixXd(compliance.transpose()));
    const Eigen::VectorXd b = Eigen::VectorXd::Random(cube.model.dof_count());
    Eigen::VectorXd x(b.size());
    cube.factor.solve(b, x, cube.workspace);
    EXPECT_LT(relative(x, inverse * b), 1e-12);
    if (nodes.empty()) continue;
    const double error = relative(compliance, inverse(dofs, dofs));
    std::printf("  %zu of %d DOFs last: W_bar off the dense inverse by %.1e\n", dofs.size(), cube.model.dof_count(),
                error);
    EXPECT_LT(error, 1e-12);
  }
}

TEST(Factorisation, CorridorOfAThousandNodesEqualsFullSolves) {
  JitteredCube cube(9);
  const std::size_t fill = [&] {
    EXPECT_TRUE(cube.factor.factorise(cube.pattern, cube.values, cube.workspace));
    return cube.factor.factor_nonzeros();
  }();
  std::vector<int> corridor = cube.nodes_where(
      [](const Eigen::Vector3d& x) { return std::abs(x.y() - 0.047) < 0.017 && std::abs(x.z() - 0.053) < 0.017; });
  cube.factorise(corridor);
  const std::vector<int> dofs = cube.dofs(corridor);
  const auto size = Eigen::Index(dofs.size());
  ASSERT_GE(size, 250);
  Eigen::MatrixXd compliance(size, size);
  cube.factor.trailing_compliance(compliance);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(cube.model.dof_count(), size);
  for (Eigen::Index k = 0; k < size; ++k) columns(dofs[k], k) = 1;
  cube.factor.solve(columns, columns, cube.workspace);
  const double error = relative(compliance, columns(dofs, Eigen::all));
  const double growth = double(cube.factor.factor_nonzeros()) / double(fill);
  std::printf("  %td DOFs: off full solves by %.1e; L has %.2f times the entries\n", size, error, growth);
  EXPECT_LT(error, 1e-12);
  EXPECT_LT(growth, 1.6) << "the order of the rest has been spoilt";
}

TEST(Factorisation, HalvesMakeAWholeAndForcesOnTrailingNodesStayInDouble) {
  JitteredCube cube(4);
  const std::vector<int> nodes{50, 60, 70, 71};
  cube.factorise(nodes);
  const std::vector<int> dofs = cube.dofs(nodes);
  const Eigen::MatrixXd inverse = cube.dense_inverse();
  const auto n = cube.model.dof_count();
  const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
  Eigen::VectorXd late = Eigen::VectorXd::Zero(n);
  late(dofs) = Eigen::VectorXd::Random(Eigen::Index(dofs.size()));
  Eigen::VectorXd y(n), y_late(n), x(n);
  cube.factor.eliminate(b, y, cube.workspace);
  cube.factor.eliminate(late, y_late, cube.workspace);
  EXPECT_EQ(y_late.head(n - Eigen::Index(dofs.size())).cwiseAbs().maxCoeff(), 0) << "reaches L_SS alone";
  cube.factor.substitute_back(y_late, x, cube.workspace);
  const Eigen::VectorXd exact_late = inverse * late;
  EXPECT_LT(relative(x(dofs), exact_late(dofs)), 1e-12);
  EXPECT_LT(relative(x, exact_late), 1e-5);
  y += y_late;
  cube.factor.substitute_back(y, y, cube.workspace);  // in place
  EXPECT_LT(relative(y, inverse * (b + late)), 1e-5);
}

TEST(IsolatedDofs, NodesInsideAndOutsideTheCorridorMatchTheDenseInverse) {
  // Through changes of corridor and overflow of the capacity; the solution at the nodes comes along.
  JitteredCube cube(4);
  const Eigen::MatrixXd inverse = cube.dense_inverse();
  IsolatedDofs isolated(cube.model.node_count(), 16);
  std::mt19937 random(5);
  const auto pick = [&](std::size_t count) {
    std::set<int> nodes;
    while (nodes.size() < count) {
      const int node = int(random() % unsigned(cube.model.node_count()));
      if (cube.model.free_index[node] >= 0) nodes.insert(node);
    }
    std::vector<int> list(nodes.begin(), nodes.end());
    std::shuffle(list.begin(), list.end(), random);
    return list;
  };
  double worst = 0;
  double worst_solution = 0;
  for (int round = 0; round < 12; ++round) {
    const std::vector<int> corridor = pick(round % 4 == 0 ? 0 : 9);
    cube.factorise(corridor);
    isolated.reset(corridor, cube.model, cube.factor);
    EXPECT_EQ(isolated.isolate(corridor, cube.model, cube.factor, cube.workspace), 0) << "no solve for the corridor";
    const Eigen::VectorXd b = Eigen::VectorXd::Random(cube.model.dof_count());
    Eigen::VectorXd y(b.size());
    cube.factor.eliminate(b, y, cube.workspace);
    for (int step = 0; step < 6; ++step) {
      std::vector<int> nodes = pick(6);
      for (const int node : corridor) {
        if (nodes.size() < 11 && std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
      }
      isolated.isolate(nodes, cube.model, cube.factor, cube.workspace);
      const std::vector<int> dofs = cube.dofs(nodes);
      Eigen::MatrixXd w_bar(dofs.size(), dofs.size());
      isolated.gather(nodes, w_bar);
      ASSERT_EQ(w_bar, Eigen::MatrixXd(w_bar.transpose()));
      worst = std::max(worst, relative(w_bar, inverse(dofs, dofs)));
      Eigen::Matrix3Xd x(3, nodes.size());
      isolated.solution_at(nodes, y, cube.factor.substitute_back_trailing(y), x);
      worst_solution = std::max(worst_solution, relative(x.reshaped(), (inverse * b)(dofs)));

      // Under forces on three nodes, two of them together, the third by itself.
      const Eigen::Vector3d force(0.2, -0.7, 0.4);
      const Eigen::Vector3d other(-0.3, 0.1, 0.5);
      Eigen::MatrixXd motions = Eigen::MatrixXd::Ones(3 * isolated.known_nodes(), 4);
      isolated.find_motions(
          std::array<IsolatedDofs::Push, 3>{{{1, nodes[2], force}, {1, nodes[4], other}, {3, nodes[3], other}}},
          motions);
      Eigen::MatrixXd found(dofs.size(), 4);
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        found.middleRows<3>(static_cast<Eigen::Index>(3 * k)) = motions.middleRows<3>(3 * isolated.place(nodes[k]));
      }
      const Eigen::MatrixXd columns = inverse(dofs, dofs);
      worst = std::max({worst,
                        relative(found.col(1), columns.middleCols<3>(6) * force + columns.middleCols<3>(12) * other),
                        relative(found.col(3), columns.middleCols<3>(9) * other)});
      EXPECT_TRUE(motions.col(0).isZero(0) && motions.col(2).isZero(0));
    }
  }
  std::printf("  W_bar off the dense inverse by %.1e, solutions (single precision) by %.1e\n", worst, worst_solution);
  EXPECT_LT(worst, 1e-12);
  EXPECT_LT(worst_solution, 1e-5);
}

TEST(IsolatedDofs, OfALargeBodyWhatIsLeftOutIsZero) {
  // From 15,000 DOFs on a node keeps only what it reaches in the elimination tree.
  JitteredCube cube(17);
  ASSERT_GT(cube.model.dof_count(), 15000);
  const std::vector<int> corridor = cube.nodes_where(
      [](const Eigen::Vector3d& x) { return std::abs(x.y() - 0.047) < 0.006 && std::abs(x.z() - 0.053) < 0.006; });
  cube.factorise(corridor);
  IsolatedDofs isolated(cube.model.node_count(), 256);
  isolated.reset(corridor, cube.model, cube.factor);
  std::vector<int> nodes = cube.nodes_where([](const Eigen::Vector3d& x) { return x.z() > 0.0999 && x.x() < 0.012; });
  for (int node = 401; node < cube.model.node_count(); node += 613) {
    if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
  }
  const int computed = isolated.isolate(nodes, cube.model, cube.factor, cube.workspace);
  ASSERT_GT(computed, 32) << "several passes";
  EXPECT_EQ(isolated.isolate(nodes, cube.model, cube.factor, cube.workspace), 0);
  const std::vector<int> dofs = cube.dofs(nodes);
  const auto size = Eigen::Index(dofs.size());
  Eigen::MatrixXd w_bar(size, size);
  isolated.gather(nodes, w_bar);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(cube.model.dof_count(), size);
  for (Eigen::Index k = 0; k < size; ++k) columns(dofs[k], k) = 1;
  cube.factor.solve(columns, columns, cube.workspace);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(cube.model.dof_count());
  Eigen::VectorXd y(b.size()), exact(b.size());
  cube.factor.eliminate(b, y, cube.workspace);
  cube.factor.solve(b, exact, cube.workspace);
  Eigen::Matrix3Xd x(3, nodes.size());
  isolated.solution_at(nodes, y, cube.factor.substitute_back_trailing(y), x);
  const double error = relative(w_bar, columns(dofs, Eigen::all));
  const double solution = relative(x.reshaped(), exact(dofs));
  std::printf("  %d nodes outside: off full solves by %.1e, solutions (16 bits) by %.1e\n", computed, error,
              solution);
  EXPECT_LT(error, 1e-12);
  EXPECT_LT(solution, 1e-2);
}

TEST(IsolatedDofsDeathTest, RefusesACorridorThatIsNotTheFactors) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  JitteredCube cube(3);
  cube.factorise({40, 41});
  IsolatedDofs isolated(cube.model.node_count(), 16);
  const std::vector<int> other{40, 42};
  EXPECT_DEATH(isolated.reset(other, cube.model, cube.factor), "not those of the factor");
  const std::vector<int> short_of_one{40};
  EXPECT_DEATH(isolated.reset(short_of_one, cube.model, cube.factor), "not those of the factor");
}

TEST(FactorisationWorker, CorridorCoversTheIsolatedNodesAndRarelyChanges) {
  // A needle goes 70 mm in at 0.9 mm a step; the worker answers every fifth step.
  SimulationBody body;
  body.mesh = JitteredCube::make_mesh(8);
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  std::vector<SimulationBody> bodies;
  bodies.push_back(std::move(body));
  SimulationLoop loop(std::move(bodies), {});
  TissuePatch patch = loop.make_patch();
  std::vector<int> corridor;
  int factors = 0;
  int changes = 0;
  int computed = 0;
  for (int step = 0; step < 80; ++step) {
    NeedleState needle;
    needle.node_count = 3;
    for (int i = 0; i < 3; ++i)
      needle.positions.col(i) = Eigen::Vector3d(-0.202 + 0.0009 * step + 0.1 * i, 0.047, 0.053);
    const SimulationReport report = loop.step({.needle = &needle}, patch);
    if (step > 5) computed += report.new_isolated_nodes;
    if (report.factorisation_taken) {
      const std::vector<int>& now = loop.worker().latest().bodies[0].trailing_nodes;
      ++factors;
      changes += now != corridor;
      corridor = now;
    }
    if (step % 5 == 4) loop.worker().step();
  }
  std::printf("  %d factors, %d corridors of at most %zu nodes; %d nodes computed outside\n", factors, changes,
              corridor.size(), computed);
  ASSERT_EQ(patch.bodies[0].contact_count, 7);
  EXPECT_EQ(computed, 0) << "every contact was foreseen";
  EXPECT_GE(factors, 12);
  EXPECT_LE(changes, factors / 2);
}

TEST(Supernodes, ColumnsAtOnceAreThoseOfOneByOne) {
  // Sizes on both sides of tiles, panels and bands; above the diagonal nothing may be read.
  double worst = 0;
  for (const int columns : {1, 2, 7, 8, 9, 17, 40}) {
    for (const int below : {0, 1, 3, 5, 61, 130}) {
      const int rows = columns + below;
      Eigen::MatrixXd l = Eigen::MatrixXd::Random(rows, columns);
      for (int c = 0; c < columns; ++c) {
        l(c, c) = 20;
        l.col(c).head(c).setConstant(std::nan(""));
      }
      std::vector<int> order(rows);
      std::iota(order.begin(), order.end(), 0);
      std::array<int, 2> super{0, columns}, row_start{0, rows}, value_start{0, rows * columns};
      cholmod_factor factor{};
      factor.super = super.data();
      factor.pi = row_start.data();
      factor.px = value_start.data();
      factor.s = order.data();
      const Supernode<double> node(factor, l.data(), 0, columns);
      std::vector<double> scratch;
      for (const int sides : {1, 2, 3, 4, 5, 7, 24}) {
        const Eigen::MatrixXd b = Eigen::MatrixXd::Random(rows, sides);
        Eigen::MatrixXd together = b;
        eliminate_columns(node, together, scratch);
        for (int j = 0; j < sides; ++j) {
          Eigen::MatrixXd alone = b.col(j);
          eliminate_columns(node, alone, scratch);
          EXPECT_EQ(together.col(j), alone.col(0));  // to the bit
          Eigen::VectorXd vector = b.col(j);
          std::vector<double> of_node(rows);
          eliminate(node, vector.data(), of_node.data());
          worst = std::max(worst, (alone.col(0) - vector).norm() / vector.norm());
        }
      }
    }
  }
  std::printf("  columns at once off one by one by %.1e\n", worst);
  EXPECT_LT(worst, 1e-15);
}

}  // namespace
}  // namespace stylet::physics
