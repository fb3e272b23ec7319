// The solve of bilateral and bounded rows whatever it is given: other starts, orders and limits, dependent rows,
// numbers that are none; and the elimination and the pivoting that it is made of.
#include "tests/physics/random_contact_problem.h"
#include "tests/support/allocation_count.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::kInfinity;
using testing::law_violation;
using testing::press;
using testing::Problem;
using testing::Random;
using testing::random_problem;
using testing::solve;
using testing::tip_problem;

// Six rows, ill-conditioned, from each of the 729 choices of states.
TEST(BoxPivoting, FindsTheSameStatesFromEveryStart) {
  Random random(15);
  constexpr int kRows = 6;
  BoxPivoting pivoting(kRows);
  int most = 0;
  double worst = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const MatrixXd s = random.compliance(kRows, 5);
    const VectorXd d = 1e-3 * random.vector(kRows);
    VectorXd lower(kRows), upper(kRows), viscosity(kRows);
    const VectorXd yielding = VectorXd::Zero(kRows);
    for (int i = 0; i < kRows; ++i) {
      lower[i] = -random.uniform(0, 3);
      upper[i] = random.uniform(0, 3);
      viscosity[i] = random.integer(0, 1) * std::pow(10.0, random.uniform(0, 5));
    }
    VectorXd first;
    for (int start = 0; start < 729; ++start) {
      MatrixXd matrix = s;
      const VectorXd diagonal = s.diagonal();
      VectorXd softening(kRows), lambda(kRows), u(kRows);
      ASSERT_EQ(pivoting.load(matrix, diagonal.data(), softening.data()), 0);
      std::array<RowState, kRows> states{};
      for (int i = 0, digits = start; i < kRows; ++i, digits /= 3) states[i] = static_cast<RowState>(digits % 3 - 1);
      int pivots = 0;
      ASSERT_TRUE(pivoting.solve(
          {matrix, d.data(), lower.data(), upper.data(), viscosity.data(), viscosity.data(), yielding.data()},
          states.data(), lambda, u, 1000, pivots));
      most = std::max(most, pivots);
      if (start == 0) first = lambda;
      worst = std::max(worst, (lambda - first).norm() / first.norm());
    }
  }
  std::printf("43740 starts: at most %d pivots, results differ by %.1e\n", most, worst);
  EXPECT_LT(worst, 1e-9);  // condition 1e5 times the 1e-13 within which a sign counts as right
}

TEST(PanelLdl, EliminationLeavesTheSchurComplementAndItsCoupling) {
  Random random(16);
  for (const auto& [leading, trailing] : {std::pair{8, 8}, {1, 1}, {5, 20}, {37, 3}, {100, 92}}) {
    const int m = leading + trailing;
    const MatrixXd w = random.compliance(m, 2);
    PanelLdl ldl(kMaxRows);
    ldl.resize(leading, trailing);
    const auto place = [&, n = leading](int i) { return i < n ? i : ldl.trailing_start() + i - n; };
    for (int j = 0; j < m; ++j) {
      for (int i = j; i < m; ++i) ldl.column(place(j))[place(i)] = w(i, j);
    }
    VectorXd softening(kMaxRows);
    ASSERT_EQ(ldl.factorise(softening.data()), 0);
    const MatrixXd a = w.topLeftCorner(leading, leading);
    const MatrixXd b = w.bottomLeftCorner(trailing, leading);
    const MatrixXd solved = reference::solve(a, b.transpose());
    const MatrixXd schur = w.bottomRightCorner(trailing, trailing) - reference::product(b, solved);
    MatrixXd coupling = MatrixXd::Zero(kMaxRows + 16, kMaxRows + 16);
    ldl.coupling(coupling);
    VectorXd x = VectorXd::Zero(ldl.size());
    const VectorXd right = random.vector(leading);
    x.head(leading) = right;
    ldl.forward(x.data());
    const VectorXd left_over = x.segment(ldl.trailing_start(), trailing);
    for (int i = 0; i < trailing; ++i) {
      for (int j = 0; j <= i; ++j) {
        EXPECT_NEAR(ldl.column(place(leading + j))[place(leading + i)], schur(i, j), 1e-16);
      }
      EXPECT_LT((coupling.row(i).head(leading) - solved.col(i).transpose()).norm(), 1e-12);
      EXPECT_NEAR(left_over[i], -solved.col(i).dot(right), 1e-12);
    }
  }
}

TEST(BoundedSolver, ResultDependsNeitherOnTheStartNorOnTheLimits) {
  Random random(4);
  for (int trial = 0; trial < 60; ++trial) {
    const Problem p = random_problem(random, 32, 24, 0.3);
    BoundedSolveReport report;
    const VectorXd cold = solve(p, &report);
    ASSERT_FALSE(report.fallback || report.lagged_bounds);
    // Another problem's states and far-off forces, then its own.
    BoundedSolver warm(kMaxRows);
    solve(warm, random_problem(random, 10, 46, 0.3), VectorXd::Zero(56));
    const VectorXd start = 50 * random.vector(p.size());
    const VectorXd other = solve(warm, p, start);
    BoundedSolveReport again;
    const VectorXd own = solve(warm, p, other, &again);
    EXPECT_LT((other - cold).norm(), 1e-11 * cold.norm());
    EXPECT_LT((own - cold).norm(), 1e-11 * cold.norm());
    EXPECT_EQ(again.pivots, 1);  // a solution is recognised
    EXPECT_EQ(again.bound_updates, 0);
    BoundedSolver just_enough(kMaxRows);
    just_enough.set_limits({.pivots = report.pivots, .bound_updates = report.bound_updates, .sweeps = 1});
    EXPECT_EQ(solve(just_enough, p, VectorXd::Zero(p.size())), cold);
    BoundedSolver plenty(kMaxRows);
    plenty.set_limits({.pivots = 100000, .bound_updates = 1000, .sweeps = 1000});
    EXPECT_EQ(solve(plenty, p, VectorXd::Zero(p.size())), cold);
  }
}

TEST(BoundedSolver, OrderOfTheRowsDoesNotMatter) {
  Random random(5);
  const Problem p = random_problem(random, 20, 12, 0.3);
  const int m = p.size();
  Problem reversed = p;
  for (int i = 0; i < m; ++i) {
    ContactRow row = p.row(m - 1 - i);
    for (int& n : row.normal) n = n >= 0 ? m - 1 - n : n;
    reversed.row(i) = row;
  }
  reversed.w = p.w.reverse();
  reversed.delta = p.delta.reverse();
  const VectorXd lambda = solve(p);
  EXPECT_LT((solve(reversed).reverse() - lambda).norm(), 1e-11 * lambda.norm());
}

TEST(BoundedSolver, ReadsTheLowerTriangleAlone) {
  Random random(6);
  Problem p = random_problem(random, 9, 7, 0.3);
  const VectorXd lambda = solve(p);
  p.w.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(solve(p), lambda);
}

TEST(BoundedSolver, BoundsThatDoNotSettleAreHeldAtThoseOfTheFirstGuess) {
  Random random(14);
  for (int trial = 0; trial < 60; ++trial) {
    const Problem p = random_problem(random, 16, 8, 1, 3);
    const VectorXd guess = 0.3 * random.vector(24);
    BoundedSolveReport report;
    BoundedSolver solver(kMaxRows);
    solver.set_limits({.bound_updates = 0});
    const VectorXd lambda = solve(solver, p, guess, &report);
    EXPECT_TRUE(report.solved && !report.fallback);
    Problem held = p;
    for (ContactRow& row : held.rows) {
      const double pressed = press(row, guess);
      EXPECT_TRUE(report.lagged_bounds || pressed == 0);
      row.lower -= pressed;
      row.upper += pressed;
      row.friction = 0;
    }
    EXPECT_LT(law_violation(held, lambda), 1e-12);
  }
}

TEST(BoundedSolver, DependentRowsGiveFiniteForcesAndAreReported) {
  Random random(8);
  for (int trial = 0; trial < 50; ++trial) {
    Problem p = random_problem(random, 12, 10, 0.3);
    const MatrixXd g = MatrixXd::NullaryExpr(22, 7, [&] { return random.uniform(-1, 1); });
    p.w = 1e-3 * g.lazyProduct(g.transpose());  // rank 7 of 22
    for (ContactRow& row : p.rows) row.compliance = 0;
    BoundedSolver solver(kMaxRows);
    BoundedSolveReport report;
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(22), &report);
    EXPECT_TRUE(report.solved);
    EXPECT_GT(report.softened_rows, 0);
    EXPECT_TRUE(lambda.allFinite());
    EXPECT_LT(report.residual, report.fallback || report.lagged_bounds ? 1.0 : 1e-11);
    // What is reported as compliance is what was solved: the laws hold with it.
    for (int i = 0; i < 22; ++i) p.row(i).compliance = solver.compliance(i);
    EXPECT_LT(law_violation(p, lambda), report.fallback || report.lagged_bounds ? 1.0 : 1e-11);
  }
}

TEST(BoundedSolver, TheSameRowTwiceIsTheRowOnce) {
  Problem p;
  p.rows = {bilateral_row(1), bilateral_row(2), unilateral_row(3), unilateral_row(4)};
  const VectorXd repeat{{1, 1, 0, 0}};
  const VectorXd other{{0.3, 0.3, 1, 1}};
  p.w = 1e-3 * (repeat * repeat.transpose() + other * other.transpose());
  p.delta = VectorXd{{-1e-3, -1e-3, -2e-3, -2e-3}};
  BoundedSolveReport report;
  const VectorXd lambda = solve(p, &report);
  EXPECT_EQ(report.softened_rows, 2);
  Problem once{{bilateral_row(1), unilateral_row(3)}, MatrixXd(2, 2), VectorXd{{-1e-3, -2e-3}}};
  once.w << p.w(0, 0), p.w(0, 2), p.w(2, 0), p.w(2, 2);
  const VectorXd expected = solve(once);
  EXPECT_NEAR(lambda[0] + lambda[1], expected[0], 1e-11);
  EXPECT_NEAR(lambda[2] + lambda[3], expected[1], 1e-11);
}

TEST(BoundedSolver, RefusesWhatHasNoSolutionAndKeepsTheForces) {
  Random random(9);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const VectorXd kept = VectorXd::LinSpaced(12, 1, 2);
  const auto refused = [&](const Problem& p) {
    BoundedSolveReport report;
    BoundedSolver solver(kMaxRows);
    const VectorXd lambda = solve(solver, p, kept, &report);
    return !report.solved && lambda == kept;
  };
  const Problem p = random_problem(random, 6, 6, 0.3);
  EXPECT_FALSE(refused(p));
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j <= i; ++j) {
      Problem bad = p;
      bad.w(i, j) = nan;
      EXPECT_TRUE(refused(bad)) << i << " " << j;
    }
    Problem bad = p;
    bad.delta[i] = kInfinity;
    EXPECT_TRUE(refused(bad)) << i;
  }
  Problem empty = p;
  empty.w.setZero();
  for (ContactRow& row : empty.rows) row.compliance = 0;
  EXPECT_TRUE(refused(empty));
  Problem crossed = p;
  crossed.rows[0] = box_row(1, 1, -1);
  EXPECT_TRUE(refused(crossed));
  BoundedSolver small(8);
  VectorXd lambda = kept;
  EXPECT_FALSE(small.solve(p.rows, p.w, p.delta, lambda).solved);
  // A spoilt first guess is only a guess.
  BoundedSolver solver(kMaxRows);
  EXPECT_LT((solve(solver, p, VectorXd::Constant(12, nan)) - solve(p)).norm(), 1e-10);
}

TEST(BoundedSolver, FallBackIsReportedBoundedAndSweepsTowardsTheSolution) {
  Random random(10);
  for (int trial = 0; trial < 20; ++trial) {
    const Problem p = random_problem(random, 16, 24, 0.2, 1);
    const VectorXd exact = solve(p);
    double last = kInfinity;
    for (const int sweeps : {1, 10, 1000}) {
      BoundedSolver solver(kMaxRows);
      solver.set_limits({.pivots = 0, .bound_updates = 0, .sweeps = sweeps});
      BoundedSolveReport report;
      const VectorXd lambda = solve(solver, p, VectorXd::Zero(p.size()), &report);
      EXPECT_TRUE(report.solved && report.fallback);
      const double distance = (lambda - exact).norm() / exact.norm();
      EXPECT_LT(distance, last);
      EXPECT_NEAR(report.residual, law_violation(p, lambda), 0.5 * report.residual + 1e-13);
      last = distance;
    }
    EXPECT_LT(last, 1e-9);
  }
}

TEST(BoundedSolver, TakesNoMemory) {
  Random random(11);
  BoundedSolver solver(kMaxRows);
  const Problem tip = tip_problem(random);
  VectorXd tip_lambda = VectorXd::Zero(tip.size());
  {
    const tests::AllocationCount count;
    solver.solve(tip.rows, tip.w, tip.delta, tip_lambda);
    EXPECT_EQ(count.value(), 0);
  }
  for (const auto& [bilateral, bounded] : {std::pair{0, 0}, {1, 0}, {0, 1}, {16, 8}, {128, 64}, {0, 192}, {192, 0}}) {
    Problem p = random_problem(random, bilateral, bounded, 0.3);
    VectorXd lambda = VectorXd::Zero(p.size());
    for (const int pivots : {200, 0}) {
      solver.set_limits({.pivots = pivots});
      const tests::AllocationCount count;
      solver.solve(p.rows, p.w, p.delta, lambda);
      EXPECT_EQ(count.value(), 0) << bilateral << " + " << bounded;
    }
  }
}

}  // namespace
}  // namespace stylet::physics
