// The solve of bilateral and bounded rows, against enumeration of all states, closed forms and its own equations.
#include "physics/contact/bounded_solver.h"
#include "physics/loops/messages.h"
#include "tests/support/allocation_count.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Problem {
  std::vector<ContactRow> rows;
  MatrixXd w;
  VectorXd delta;
  int size() const { return static_cast<int>(rows.size()); }
  ContactRow& row(int i) { return rows[i]; }
  const ContactRow& row(int i) const { return rows[i]; }
};

/// Units as in the contact system: W around 1e-3 m/N, delta around 1e-3 m.
class Random {
public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  int integer(int a, int b) { return std::uniform_int_distribution<int>(a, b)(engine_); }
  VectorXd vector(int n) {
    return VectorXd::NullaryExpr(n, [&] { return normal_(engine_); });
  }
  /// Symmetric positive definite with eigenvalues spread over `decades`.
  MatrixXd compliance(int n, double decades) {
    const MatrixXd g = MatrixXd::NullaryExpr(n, n, [&] { return normal_(engine_); });
    const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(g).householderQ();
    VectorXd values(n);
    for (int i = 0; i < n; ++i) values[i] = 1e-3 * std::pow(10.0, -uniform(0, decades));
    const MatrixXd w = q * values.asDiagonal() * q.transpose();
    return 0.5 * (w + w.transpose());
  }

private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

/// Boxes, unilateral rows, friction without and with a dashpot, among bilateral rows, in no order.
Problem random_problem(Random& random, int bilateral, int bounded, double friction, double decades = 2) {
  Problem p;
  const int m = bilateral + bounded;
  p.w = random.compliance(m, decades);
  p.delta = 1e-3 * random.vector(m);
  std::vector<int> order(m);
  for (int i = 0; i < m; ++i) order[i] = i;
  for (int i = m - 1; i > 0; --i) std::swap(order[i], order[random.integer(0, i)]);
  std::vector<int> lateral(order.begin(), order.begin() + bilateral);
  p.rows.resize(m);
  for (const int i : lateral) p.row(i) = bilateral_row(100u + static_cast<unsigned>(i), random.integer(0, 1) * 1e-5);
  for (int k = bilateral; k < m; ++k) {
    const int i = order[k];
    const auto id = 100u + static_cast<unsigned>(i);
    const double c = random.integer(0, 1) * random.uniform(0, 1e-4);
    ContactRow row;
    switch (random.integer(0, 3)) {
      case 0:
        row = unilateral_row(id, c);
        break;
      case 1:
        row = box_row(id, -random.uniform(0, 2), random.uniform(0, 2), c);
        break;
      default: {
        std::array<int, 2> normal{ContactRow::kNone, ContactRow::kNone};
        if (bilateral > 1) {
          const int a = random.integer(0, bilateral - 2);
          normal = {lateral[a], lateral[a + 1]};
        }
        const double viscosity = random.integer(0, 1) * std::pow(10.0, random.uniform(0, 5));
        row = friction_row(id, random.uniform(0, 1), friction * random.uniform(0, 1), normal, viscosity, c);
      }
    }
    p.row(i) = row;
  }
  return p;
}

double press(const ContactRow& row, const VectorXd& lambda) {
  double square = 0;
  for (const int n : row.normal) square += n >= 0 ? lambda[n] * lambda[n] : 0;
  return row.friction * std::sqrt(square);
}

VectorXd motion(const Problem& p, const VectorXd& lambda) {
  VectorXd u = p.w * lambda + p.delta;
  for (int i = 0; i < p.size(); ++i) u[i] += p.row(i).compliance * lambda[i];
  return u;
}

/// How far a row is from its law: bilateral |u|; else the smallest of the violations of its three branches. Motion is
/// counted as the force that would undo it.
double law_violation(const Problem& p, const VectorXd& lambda) {
  const VectorXd u = motion(p, lambda);
  double worst = 0;
  double largest = 0;
  for (int i = 0; i < p.size(); ++i) {
    const ContactRow& row = p.row(i);
    const double w = p.w(i, i) + row.compliance;
    largest = std::max({largest, std::abs(lambda[i]), std::abs(p.delta[i]) / w});
    const double f = u[i] / w;
    double violation = std::abs(f);
    if (!row.bilateral && row.across < 0) {
      const double lo = row.lower - press(row, lambda);
      const double hi = row.upper + press(row, lambda);
      const double dashpot = row.viscosity * w;
      const double sticking = std::max({std::abs(f), lambda[i] - hi, lo - lambda[i]});
      const double upper = std::max(std::abs(lambda[i] - hi + dashpot * f) / (1 + dashpot), f);
      const double lower = std::max(std::abs(lambda[i] - lo + dashpot * f) / (1 + dashpot), -f);
      violation = std::min({sticking, std::isfinite(hi) ? upper : kInfinity, std::isfinite(lo) ? lower : kInfinity});
    }
    worst = std::max(worst, violation);
  }
  return worst / largest;
}

VectorXd solve(BoundedSolver& solver, const Problem& p, VectorXd lambda, BoundedSolveReport* report = nullptr) {
  const BoundedSolveReport r = solver.solve(p.rows, p.w, p.delta, lambda);
  if (report != nullptr) *report = r;
  return lambda;
}

VectorXd solve(const Problem& p, BoundedSolveReport* report = nullptr) {
  BoundedSolver solver(kMaxRows);
  return solve(solver, p, VectorXd::Zero(p.size()), report);
}

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
    const VectorXd lambda = a.partialPivLu().solve(b);
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
      ASSERT_TRUE(pivoting.solve(matrix, d.data(),
                                 {lower.data(), upper.data(), viscosity.data(), viscosity.data(), yielding.data()},
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
    const MatrixXd solved = a.partialPivLu().solve(b.transpose());
    const MatrixXd schur = w.bottomRightCorner(trailing, trailing) - b * solved;
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
    const VectorXd sticking = p.w.ldlt().solve(-p.delta);
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

// A tip on a surface under a needle that is held laterally by rows of its own.
Problem tip_problem(Random& random) {
  Problem p = random_problem(random, 12, 5, 0.2, 1);
  const int m = p.size();
  p.rows.push_back(unilateral_row(500));
  p.rows.push_back(disc_row(501, m + 2, 0.05, 0.4, {m, -1}));
  p.rows.push_back(disc_row(502, m + 1, 0.05, 0.4, {m, -1}));
  p.w = random.compliance(m + 3, 1);
  p.delta.conservativeResize(m + 3);
  p.delta.tail(3) = 1e-3 * random.vector(3);
  p.delta[m] = -1e-3 * random.uniform(-0.5, 2);
  return p;
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
    q.w = turn * p.w * turn.transpose();
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

TEST(BoundedSolver, DependentRowsGiveFiniteForcesAndAreReported) {
  Random random(8);
  for (int trial = 0; trial < 50; ++trial) {
    Problem p = random_problem(random, 12, 10, 0.3);
    const MatrixXd g = MatrixXd::NullaryExpr(22, 7, [&] { return random.uniform(-1, 1); });
    p.w = 1e-3 * g * g.transpose();  // rank 7 of 22
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
