// The solve of bilateral and bounded rows, against enumeration of all states, closed forms and the laws themselves.
#include "tests/physics/random_contact_problem.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>
#include <optional>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::kInfinity;
using testing::law_violation;
using testing::motion;
using testing::press;
using testing::Problem;
using testing::Random;
using testing::random_problem;
using testing::solve;
using testing::tip_problem;

/// The solution for given additions to the bounds, by trying every choice of states with a general dense solve.
std::optional<VectorXd> enumerate(const Problem& p, const VectorXd& pressed) {
  const int m = p.size();
  std::vector<int> bounded;
  for (int i = 0; i < m; ++i) {
    if (!p.row(i).bilateral) bounded.push_back(i);
  }
  MatrixXd w = p.w;
  for (int i = 0; i < m; ++i) w(i, i) += p.row(i).compliance;
  long choices = 1;
  for (std::size_t i = 0; i < bounded.size(); ++i) choices *= 3;
  for (long choice = 0; choice < choices; ++choice) {
    MatrixXd a = w;
    VectorXd b = -p.delta;
    std::vector<int> states;
    bool possible = true;
    long digits = choice;
    for (const int i : bounded) {
      const ContactRow& row = p.row(i);
      states.push_back(static_cast<int>(digits % 3) - 1);
      digits /= 3;
      if (states.back() == 0) continue;
      const double bound = states.back() > 0 ? row.upper + pressed[i] : row.lower - pressed[i];
      possible = possible && std::isfinite(bound);
      a.row(i) = row.viscosity * w.row(i);  // lambda + k u = bound
      a(i, i) += 1;
      b[i] = bound - row.viscosity * p.delta[i];
    }
    if (!possible) continue;
    const VectorXd lambda = reference::solve(a, b);
    const VectorXd u = w * lambda + p.delta;
    for (std::size_t k = 0; k < bounded.size() && possible; ++k) {
      const int i = bounded[k];
      const ContactRow& row = p.row(i);
      constexpr double kForce = 1e-10;
      constexpr double kMotion = 1e-14;
      possible = states[k] == 0
                     ? lambda[i] <= row.upper + pressed[i] + kForce && lambda[i] >= row.lower - pressed[i] - kForce
                     : states[k] * u[i] <= kMotion;
    }
    if (possible) return lambda;
  }
  return std::nullopt;
}

TEST(BoundedSolver, EqualsTheOnlyChoiceOfStatesThatFits) {
  Random random(1);
  double worst = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Problem p = random_problem(random, random.integer(0, 6), trial < 8 ? 8 : random.integer(1, 5), 0);
    BoundedSolveReport report;
    const VectorXd lambda = solve(p, &report);
    const auto expected = enumerate(p, VectorXd::Zero(p.size()));
    ASSERT_TRUE(expected.has_value());
    EXPECT_FALSE(report.fallback || report.lagged_bounds);
    worst = std::max(worst, (lambda - *expected).norm() / expected->norm());
  }
  std::printf("largest distance from the enumerated solution: %.1e\n", worst);
  EXPECT_LT(worst, 1e-11);  // condition 1e2 times rounding, in both
}

TEST(BoundedSolver, BoundsThatDependOnNormalForcesAreTheFixedPointOfEnumeration) {
  Random random(2);
  double worst = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const Problem p = random_problem(random, random.integer(2, 6), random.integer(1, 4), 0.3);
    BoundedSolveReport report;
    const VectorXd lambda = solve(p, &report);
    EXPECT_FALSE(report.fallback || report.lagged_bounds);
    VectorXd pressed = VectorXd::Zero(p.size());
    VectorXd expected;
    for (int i = 0; i < 200; ++i) {
      const auto next = enumerate(p, pressed);
      ASSERT_TRUE(next.has_value());
      expected = *next;
      VectorXd now(p.size());
      for (int k = 0; k < p.size(); ++k) now[k] = press(p.row(k), expected);
      if ((now - pressed).norm() < 1e-14) break;
      pressed = now;
    }
    worst = std::max(worst, (lambda - expected).norm() / expected.norm());
  }
  std::printf("largest distance from the iterated enumeration: %.1e\n", worst);
  EXPECT_LT(worst, 1e-10);
}

TEST(BoundedSolver, LawsHoldToRoundingUpTo192Rows) {
  Random random(3);
  for (const auto& [bilateral, bounded] : {std::pair{16, 8}, {64, 32}, {128, 64}, {96, 96}, {0, 192}, {192, 0}}) {
    double worst = 0;
    int pivots = 0;
    int updates = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const Problem p = random_problem(random, bilateral, bounded, 0.3, 4);
      BoundedSolveReport report;
      const VectorXd lambda = solve(p, &report);
      EXPECT_TRUE(report.solved);
      EXPECT_FALSE(report.fallback || report.lagged_bounds);
      EXPECT_EQ(report.softened_rows, 0);
      worst = std::max(worst, law_violation(p, lambda));
      pivots = std::max(pivots, report.pivots);
      updates = std::max(updates, report.bound_updates);
      EXPECT_LE(report.residual, 1e-12);
    }
    std::printf("%3d + %3d rows: violation %.1e, at most %d pivots, %d updates of the bounds\n", bilateral, bounded,
                worst, pivots, updates);
    EXPECT_LE(worst, 1e-12);
  }
}

// A block dragged by a spring over dry ground, then back. The row's own memory is the anchor: where the spring of
// stiffness 1/W would be without force.
TEST(BoundedSolver, SpringLoadedBlockSticksSlipsAndSpringsBackExactly) {
  constexpr double kStiffness = 400;  // N/m
  constexpr double kBound = 0.3;      // N
  BoundedSolver solver(kMaxRows);
  Problem p{{friction_row(1, kBound, 0, {-1, -1})}, MatrixXd::Constant(1, 1, 1 / kStiffness), VectorXd::Zero(1)};
  double anchor = 0;  // of the spring's end on the ground
  double work = 0;
  double last = 0;
  for (int step = 1; step <= 400; ++step) {
    const double x = 3e-3 * std::sin(2 * std::numbers::pi * step / 200);
    p.delta[0] = x - anchor;
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(1));
    const double trial = -kStiffness * (x - anchor);
    const double expected = std::clamp(trial, -kBound, kBound);
    EXPECT_DOUBLE_EQ(lambda[0], expected);
    EXPECT_EQ(solver.state(0) == RowState::sticking, std::abs(trial) <= kBound);
    anchor += solver.motion()[0];
    work -= lambda[0] * (x - last);
    last = x;
  }
  // Two loops, each sliding twice over 2 (amplitude - slack) at the bound; the first quarter started without tension.
  EXPECT_GT(work, 0);
}

TEST(BoundedSolver, FrictionBoundIsMuTimesTheNormalForceExactly) {
  // Two bilateral rows carry 3 and 4 N, whatever the third does: the third slides at 0.1 + 0.25 * 5 N.
  Problem p;
  p.rows = {bilateral_row(1), bilateral_row(2), friction_row(3, 0.1, 0.25, {0, 1})};
  p.w = MatrixXd::Identity(3, 3) * 1e-3;
  p.delta = VectorXd{{-3e-3, 4e-3, -1}};
  EXPECT_NEAR(solve(p)[2], 0.1 + 0.25 * 5, 1e-15);
  p.delta[2] = 1;
  EXPECT_NEAR(solve(p)[2], -(0.1 + 0.25 * 5), 1e-15);
  p.delta[2] = 1e-3;  // asks for 1 N: sticks
  EXPECT_NEAR(solve(p)[2], -1, 1e-15);

  // Coupled: lambda_n = -(delta_n + w_nt lambda_t) / w_nn and lambda_t = mu lambda_n.
  Problem q;
  q.rows = {unilateral_row(1), friction_row(2, 0, 0.5, {0, -1})};
  q.w = (Eigen::Matrix2d() << 2e-3, 6e-4, 6e-4, 1e-3).finished();
  q.delta = VectorXd{{-4e-3, -1e-2}};
  const double normal = 4e-3 / (2e-3 + 0.5 * 6e-4);
  EXPECT_NEAR(solve(q)[0], normal, 1e-14);
  EXPECT_NEAR(solve(q)[1], 0.5 * normal, 1e-14);
  q.delta[0] = 4e-3;  // lifted: nothing to rub on
  EXPECT_EQ(solve(q), VectorXd::Zero(2));
}

TEST(BoundedSolver, ViscousFrictionIsExactOnBothSides) {
  // lambda = bound + k v h with v from the same step's spring: s lambda + d = u, lambda = hi - k u.
  constexpr double kCompliance = 2e-3;
  constexpr double kBound = 0.4;
  constexpr double kViscosity = 700;
  Problem p{
      {friction_row(1, kBound, 0, {-1, -1}, kViscosity)}, MatrixXd::Constant(1, 1, kCompliance), VectorXd::Zero(1)};
  for (const double d : {-5e-3, -1e-3, -0.8e-3, -1e-4, 0.0, 1e-4, 0.8e-3, 1e-3, 5e-3}) {
    p.delta[0] = d;
    const double lambda = solve(p)[0];
    const double dry = -d / kCompliance;
    const double expected = std::abs(dry) <= kBound
                                ? dry
                                : (std::copysign(kBound, dry) - kViscosity * d) / (1 + kViscosity * kCompliance);
    EXPECT_NEAR(lambda, expected, 1e-14 * (1 + std::abs(expected)));
  }
}

// Friction of a point on a plane: sliding force against the sliding, |force| on the bound, found by trying
// directions.
TEST(BoundedSolver, DiscSlidesAgainstItsForceInEveryDirection) {
  Random random(12);
  double worst = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Problem p;
    const double bound = random.uniform(0.05, 1);
    p.rows = {disc_row(1, 1, bound, 0, {-1, -1}), disc_row(2, 0, bound, 0, {-1, -1})};
    p.w = random.compliance(2, 2);
    p.delta = 1e-3 * random.vector(2);
    BoundedSolver solver(kMaxRows);
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(2));
    const VectorXd sticking = reference::solve(p.w, -p.delta);
    if (sticking.norm() <= bound) {
      worst = std::max(worst, (lambda - sticking).norm());
      EXPECT_EQ(solver.state(0), RowState::sticking);
      continue;
    }
    // u = W lambda + delta turns once with the angle of lambda: bisect on the component of u across lambda.
    const auto force = [&](double angle) { return VectorXd{{bound * std::cos(angle), bound * std::sin(angle)}}; };
    const auto across = [&](double angle) {
      const VectorXd u = p.w * force(angle) + p.delta;
      return -std::sin(angle) * u[0] + std::cos(angle) * u[1];
    };
    double found = kInfinity;
    for (int i = 0; i < 3600; ++i) {
      double a = 2 * std::numbers::pi * i / 3600;
      double b = 2 * std::numbers::pi * (i + 1) / 3600;
      if (across(a) * across(b) > 0) continue;
      for (int k = 0; k < 60; ++k) (across(a) * across(0.5 * (a + b)) <= 0 ? b : a) = 0.5 * (a + b);
      if (force(a).dot(p.w * force(a) + p.delta) < 0) found = a;
    }
    ASSERT_LT(found, 10);
    worst = std::max(worst, (lambda - force(found)).norm());
  }
  std::printf("largest distance from the direction found by bisection: %.1e N\n", worst);
  EXPECT_LT(worst, 1e-12);
}

// The law itself: force against the motion, of its bound and what the dashpot adds.
TEST(BoundedSolver, AViscousDiscSlidesAgainstItsForceWithWhatItsSpeedAdds) {
  Random random(21);
  double worst = 0;
  int sliding = 0, without_bound = 0;
  for (int trial = 0; trial < 300; ++trial) {
    constexpr int kDiscs = 4;
    Problem p;
    const double viscosity = std::pow(10.0, random.uniform(0, 5));
    std::vector<double> bounds;
    for (int d = 0; d < kDiscs; ++d) {
      bounds.push_back(trial % 5 == 0 && d == 0 ? 0.0 : random.uniform(0.05, 1));
      p.rows.push_back(disc_row(2 * d + 1, 2 * d + 1, bounds[d], 0, {-1, -1}, 0, viscosity));
      p.rows.push_back(disc_row(2 * d + 2, 2 * d, bounds[d], 0, {-1, -1}, 0, viscosity));
    }
    p.w = random.compliance(2 * kDiscs, 2);
    p.delta = 2e-3 * random.vector(2 * kDiscs);
    BoundedSolveReport report;
    BoundedSolver solver(kMaxRows);
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(2 * kDiscs), &report);
    ASSERT_TRUE(report.solved && !report.fallback && !report.lagged_bounds) << trial;
    const VectorXd motion = p.w * lambda + p.delta;
    for (int d = 0; d < kDiscs; ++d) {
      const Eigen::Vector2d force = lambda.segment<2>(2 * d), u = motion.segment<2>(2 * d);
      if (u.norm() < 1e-15) {
        EXPECT_LE(force.norm(), bounds[d] + 1e-12);
        continue;
      }
      ++sliding;
      without_bound += bounds[d] == 0;
      const Eigen::Vector2d law = -(bounds[d] / u.norm() + viscosity) * u;
      worst = std::max(worst, (force - law).norm() / (1 + force.norm()) / (1 + viscosity * p.w(2 * d, 2 * d)));
    }
  }
  std::printf("%d slide, %d without a bound; off the law by %.1e\n", sliding, without_bound, worst);
  EXPECT_GT(sliding, 300);
  EXPECT_GT(without_bound, 30);
  EXPECT_LT(worst, 1e-10);
}

TEST(BoundedSolver, TipOnASurfaceDoesNotDependOnTheAxesOfItsFriction) {
  Random random(13);
  double worst = 0;
  double law = 0;
  int sliding = 0;
  int lifted = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Problem p = tip_problem(random);
    const int n = p.size();
    BoundedSolveReport report;
    BoundedSolver solver(kMaxRows);
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(n), &report);
    ASSERT_TRUE(report.solved && !report.fallback && !report.lagged_bounds);
    lifted += lambda[n - 3] == 0;
    // The law, written out.
    const double bound = 0.05 + 0.4 * lambda[n - 3];
    const Eigen::Vector2d force = lambda.tail(2);
    const Eigen::Vector2d u = motion(p, lambda).tail(2);
    EXPECT_LE(force.norm(), bound * (1 + 1e-12));
    if (u.norm() > 1e-12) {
      ++sliding;
      law = std::max(law, std::abs(force.norm() - bound));
      law = std::max(law, (force / force.norm() + u / u.norm()).norm() * std::min(1.0, u.norm() / 1e-3));
    }
    MatrixXd turn = MatrixXd::Identity(n, n);
    const double angle = random.uniform(0, 6.28);
    turn.bottomRightCorner(2, 2) << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    Problem q = p;
    q.w = reference::product(turn, reference::product(p.w, turn.transpose()));
    q.delta = turn * p.delta;
    const VectorXd turned = turn.transpose() * solve(solver, q, VectorXd::Zero(n), &report);
    worst = std::max(worst, (turned - lambda).norm() / lambda.norm());
    solve(solver, q, turn * lambda, &report);
    EXPECT_EQ(report.bound_updates, 0);  // its yielding is remembered
  }
  std::printf("%d of 200 slide, %d lifted; turned axes change %.1e; law %.1e\n", sliding, lifted, worst, law);
  EXPECT_GT(sliding, 50);
  EXPECT_LT(worst, 1e-11);
  EXPECT_LT(law, 1e-11);
}

TEST(BoundedSolver, FrictionNeverDrives) {
  Random random(7);
  for (int trial = 0; trial < 100; ++trial) {
    const Problem p = trial % 2 ? random_problem(random, 16, 12, 0.5) : tip_problem(random);
    BoundedSolver solver(kMaxRows);
    const VectorXd lambda = solve(solver, p, VectorXd::Zero(p.size()));
    if (trial % 2 == 0) {
      const std::size_t n = p.rows.size();
      EXPECT_LE(lambda[n - 2] * solver.motion()[n - 2] + lambda[n - 1] * solver.motion()[n - 1], 0);
    }
    for (int i = 0; i < p.size(); ++i) {
      if (p.row(i).across >= 0) continue;
      if (p.row(i).bilateral) continue;
      const double u = solver.motion()[i];
      EXPECT_LE(lambda[i] * u, 0) << i;
    }
  }
}

}  // namespace
}  // namespace stylet::physics
