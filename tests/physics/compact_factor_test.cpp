// L in few bits: what it does to a solve and to an iteration, and what it must not touch.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/factor_panels.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/refinement.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

/// A cube held at its bottom and bent by `turn` degrees, large enough for few bits; 60 nodes are eliminated last.
struct BentCube {
  explicit BentCube(double poisson_ratio, double turn = 0, Element element = Element::linear, int cells = 6)
      : mesh(mesh_of(element, cells)),
        model(mesh, std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, poisson_ratio}),
              reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; }), 0, element) {
    positions = rest_positions(model);
    if (turn > 0) {
      const double curvature = turn * std::numbers::pi / 180 / 0.1;
      for (int n = 0; n < model.node_count(); ++n) {
        const double radius = 1 / curvature + 0.05 - positions(0, n);
        const double angle = positions(2, n) * curvature;
        positions(0, n) = 1 / curvature + 0.05 - radius * std::cos(angle);
        positions(2, n) = radius * std::sin(angle);
      }
    }
    std::vector<Eigen::Quaterniond> rotations(model.point_count(), Eigen::Quaterniond::Identity());
    inverted = update_rotations(model, positions, rotations);
    std::vector<Eigen::Matrix3d> cofactors(model.is_quadratic() ? model.point_count() : 0,
                                           Eigen::Matrix3d::Identity());
    pattern.assemble(model, rotations, 1, values, {}, cofactors);
    std::vector<int> trailing;
    for (int dof = model.dof_count() / 2; dof < model.dof_count() / 2 + 180; ++dof) trailing.push_back(dof);
    EXPECT_TRUE(factor.order_last(trailing, pattern, workspace));
  }
  /// @param cells  quadratic ones along an edge; twice as many linear ones
  static TetMesh mesh_of(Element element, int cells = 6) {
    if (element == Element::linear) cells *= 2;
    TetMesh mesh =
        reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
    return element == Element::quadratic ? refined(mesh) : mesh;
  }
  void factorise(PassPrecision coarsest) {
    factor.limit_precision(coarsest, 0);  // however small it is
    ASSERT_TRUE(factor.factorise(pattern, values, workspace));
  }
  Eigen::VectorXd times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(x.size());
    for (int c = 0; c < model.dof_count(); ++c) {
      for (int k = pattern.column_start()[c]; k < pattern.column_start()[c + 1]; ++k) {
        const int r = pattern.rows()[k];
        y[r] += values[k] * x[c];
        if (r != c) y[c] += values[k] * x[r];
      }
    }
    return y;
  }
  /// What a step of x -= M (A x - b) multiplies the error by: the largest eigenvalue of 1 - M A, by powers.
  double contraction() {
    Eigen::VectorXd error = Eigen::VectorXd::Random(model.dof_count()).normalized();
    Eigen::VectorXd solved(error.size());
    double factor_of_last = 0;
    for (int i = 0; i < 30; ++i) {
      factor.solve_nearly(times(error), solved, workspace);
      error -= solved;
      factor_of_last = error.norm();
      error /= factor_of_last;
    }
    return factor_of_last;
  }

  TetMesh mesh;
  TissueModel model;
  Eigen::Matrix3Xd positions;
  int inverted = 0;
  StiffnessPattern pattern{model};
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  SolveWorkspace workspace;
  Factorisation factor{pattern, workspace};
};

/// The furthest that random entries, the largest and the smallest are off when they are read back, in units.
template <typename Entries>
float furthest_off() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> any(-Entries::kLargest, Entries::kLargest);
  std::array<std::uint8_t, 64> bytes{};
  float furthest = 0;
  for (int round = 0; round < 20000; ++round) {
    std::array<float, 8> entries{};
    for (float& entry : entries) entry = any(random);
    entries[static_cast<std::size_t>(round % 8)] = (round / 8 % 2 == 0 ? 1 : -1) * Entries::kLargest;
    Entries::pack(entries, bytes.data());
    const panels::Row read = Entries::load(bytes.data());
    for (std::size_t i = 0; i < entries.size(); ++i)
      furthest = std::max(furthest, std::abs(read[i] / Entries::kUnit - entries[i]));
  }
  return furthest;
}

TEST(FactorPanels, EntriesAreReadBackToTheNearestUnit) {
  const std::array<float, 4> off{furthest_off<panels::EightBits>(), furthest_off<panels::TwelveBits>(),
                                 furthest_off<panels::SixteenBits>(), furthest_off<panels::Single>()};
  std::printf("  8, 12, 16 bits and single: off by %.4f, %.4f, %.4f, %.0f units at most\n", off[0], off[1], off[2],
              off[3]);
  EXPECT_LE(off[0], 0.5F);
  EXPECT_LE(off[1], 0.5F);  // what lies behind the second of two is known when it is rounded
  EXPECT_LE(off[2], 0.5F);
  EXPECT_EQ(off[3], 0);
}

TEST(CompactFactor, AnIterationWithFewBitsConvergesFastWhateverTheMaterialElementAndBend) {
  for (const PassPrecision coarsest : {PassPrecision::twelve_bits, PassPrecision::sixteen_bits}) {
    for (const Element element : {Element::linear, Element::quadratic}) {
      for (const double poisson_ratio : {0.45, 0.49, 0.499}) {
        for (const double turn : {0.0, 60.0}) {
          BentCube cube(poisson_ratio, turn, element);
          ASSERT_EQ(cube.inverted, 0);
          cube.factorise(coarsest);
          const PassPrecision precision = cube.factor.pass_precision();
          if (poisson_ratio < 0.499) {
            EXPECT_EQ(precision, coarsest);
          }
          const double rate = cube.contraction();
          const double bits = 8.0 * static_cast<double>(cube.factor.compact().bytes()) /
                              static_cast<double>(cube.factor.factor_nonzeros());
          std::printf(
              "  %s, nu %.3f, bent by %2.0f degrees: estimate %.1e, %.1f bits an entry, error times %.1e a step\n",
              element == Element::linear ? "linear" : "quadratic", poisson_ratio, turn,
              cube.factor.reciprocal_condition(cube.workspace), bits, rate);
          EXPECT_LT(rate, precision == PassPrecision::twelve_bits ? 0.15 : 0.05);
          if (precision != PassPrecision::single) {
            EXPECT_GT(rate, 1e-5) << "not in few bits after all";
          }
        }
      }
    }
  }
}

TEST(CompactFactor, OfThemselvesLargeBodiesAreReadInTwelveBitsSmallerOnesInSixteen) {
  for (const auto& [cells, precision] :
       {std::pair(6, PassPrecision::sixteen_bits), {10, PassPrecision::twelve_bits}}) {
    BentCube cube(0.49, 0, Element::quadratic, cells);
    ASSERT_TRUE(cube.factor.factorise(cube.pattern, cube.values, cube.workspace));
    EXPECT_EQ(cube.factor.pass_precision(), precision);
    const double rate = cube.contraction();
    std::printf("  %d DOFs, L of %.1f million entries: estimate %.1e, error times %.1e a step\n",
                cube.model.dof_count(), 1e-6 * static_cast<double>(cube.factor.factor_nonzeros()),
                cube.factor.reciprocal_condition(cube.workspace), rate);
    EXPECT_LT(rate, 0.15);
  }
}

TEST(CompactFactor, PassesAreThoseInDoubleButForTheRounding) {
  BentCube cube(0.45);
  const Eigen::VectorXd b = Eigen::VectorXd::Random(cube.model.dof_count());
  const auto run = [&](PassPrecision precision) {
    cube.factorise(precision);
    EXPECT_EQ(cube.factor.pass_precision(), precision);
    Eigen::VectorXd y(b.size());
    Eigen::VectorXd x(b.size());
    cube.factor.eliminate(b, y, cube.workspace);
    cube.factor.substitute_back(b, x, cube.workspace);
    return std::pair(y, x);
  };
  const auto [y, x] = run(PassPrecision::full);
  // Each pass to the unit of its entries times the condition of L, about a hundred here.
  for (const auto& [precision, bound] : {std::pair(PassPrecision::single, 1e-5),
                                         {PassPrecision::sixteen_bits, 2e-3},
                                         {PassPrecision::twelve_bits, 2e-2}}) {
    const auto [y_nearly, x_nearly] = run(precision);
    const double first = (y_nearly - y).norm() / y.norm();
    const double second = (x_nearly - x).norm() / x.norm();
    std::printf("  %zu kB: first pass off by %.1e, second by %.1e; bound %.0e\n",
                cube.factor.compact().bytes() / 1024, first, second, bound);
    EXPECT_LT(first, bound);
    EXPECT_LT(second, bound);
  }
  EXPECT_LT(static_cast<double>(cube.factor.compact().bytes()), 1.8 * double(cube.factor.factor_nonzeros()));
}

TEST(CompactFactor, ComplianceOfTheTrailingNodesDoesNotKnowThePrecision) {
  BentCube cube(0.45);
  std::vector<Eigen::MatrixXd> compliances;
  for (const PassPrecision precision : {PassPrecision::full, PassPrecision::twelve_bits}) {
    cube.factorise(precision);
    compliances.emplace_back(180, 180);
    cube.factor.trailing_compliance(compliances.back());
    // And a force on them moves them in double.
    Eigen::VectorXd b = Eigen::VectorXd::Zero(cube.model.dof_count());
    Eigen::VectorXd x(b.size());
    Eigen::VectorXd exact(b.size());
    for (const int dof : cube.factor.trailing()) b[dof] = 1 + 0.01 * dof;
    cube.factor.solve_nearly(b, x, cube.workspace);
    cube.factor.solve(b, exact, cube.workspace);
    for (const int dof : cube.factor.trailing()) EXPECT_NEAR(x[dof], exact[dof], 1e-12 * exact.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(compliances[0], compliances[1]);
}

TEST(CompactFactor, AnIllConditionedBodyIsReadInSingleAndThenInDouble) {
  const auto precision_at = [](double poisson_ratio) {
    BentCube cube(poisson_ratio);
    cube.factorise(PassPrecision::twelve_bits);
    std::printf("  nu %.6f: estimate %.1e\n", poisson_ratio, cube.factor.reciprocal_condition(cube.workspace));
    EXPECT_LT(cube.contraction(), 0.05);
    return cube.factor.pass_precision();
  };
  EXPECT_EQ(precision_at(0.49), PassPrecision::twelve_bits);
  EXPECT_EQ(precision_at(0.4998), PassPrecision::single);
  EXPECT_EQ(precision_at(0.49999), PassPrecision::full);
}

TEST(CompactFactor, ABadNumberStaysVisible) {
  BentCube cube(0.45);
  cube.factorise(PassPrecision::twelve_bits);
  ASSERT_EQ(cube.factor.pass_precision(), PassPrecision::twelve_bits);
  Eigen::VectorXd x(cube.model.dof_count());
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Eigen::VectorXd b = Eigen::VectorXd::Ones(x.size());
    b[7] = bad;
    cube.factor.eliminate(b, x, cube.workspace);
    EXPECT_FALSE(x.allFinite());
    cube.factor.substitute_back(b, x, cube.workspace);
    EXPECT_FALSE(x.allFinite());
  }
  cube.values[11] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cube.factor.factorise(cube.pattern, cube.values, cube.workspace));
}

TEST(CompactFactor, EquilibriumDoesNotKnowThePrecision) {
  const auto at_rest = [](PassPrecision coarsest) {
    std::vector<SimulationBody> bodies(1);
    bodies[0].mesh = BentCube::mesh_of(Element::linear);
    bodies[0].tet_materials.assign(bodies[0].mesh.tets.size(), {10e3, 0.45});
    bodies[0].fixed_nodes =
        reference::nodes_where(bodies[0].mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
    bodies[0].load = Eigen::Matrix3Xd::Zero(3, Eigen::Index(bodies[0].mesh.nodes.size()));
    for (const int node : reference::nodes_where(bodies[0].mesh, [](auto& x) { return x.z() > 0.1 - 1e-9; })) {
      bodies[0].load.col(node) = Eigen::Vector3d(0.01, 0.003, -0.005);
    }
    SimulationLoop loop(std::move(bodies), {.coarsest = coarsest});
    EXPECT_EQ(loop.worker().latest().bodies[0].factor.pass_precision(), coarsest);
    TissuePatch patch = loop.make_patch();
    double residual = 0;
    int steps = 0;
    do {
      residual = loop.step({}, patch).residual_n;
      if (steps % 5 == 4) loop.worker().step();
    } while (++steps < 400 && residual > 1e-12);
    std::printf("  %d steps, residual %.1e N\n", steps, residual);
    return loop.tissue().positions[0];
  };
  const Eigen::Matrix3Xd exact = at_rest(PassPrecision::full);
  const double moved = (exact - rest_positions(BentCube(0.45).model)).colwise().norm().maxCoeff();
  const double off = (at_rest(PassPrecision::sixteen_bits) - exact).colwise().norm().maxCoeff();
  std::printf("  moved by %.1f mm, with few bits by %.1e of that more or less\n", 1e3 * moved, off / moved);
  EXPECT_GT(moved, 0.005);
  EXPECT_LT(off, 1e-10 * moved);
}

}  // namespace
}  // namespace stylet::physics
