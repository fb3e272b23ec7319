// Random systems of contact rows of every kind, and how far multipliers are from the rows' laws: written here from
// the laws, with nothing of the solver's.
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/messages/messages.h"
#include "tools/reference/dense_algebra.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace stylet::physics::testing {

using Eigen::MatrixXd;
using Eigen::VectorXd;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
    const MatrixXd q = reference::orthogonal_factor(g);
    VectorXd values(n);
    for (int i = 0; i < n; ++i) values[i] = 1e-3 * std::pow(10.0, -uniform(0, decades));
    const MatrixXd w = reference::product(q * values.asDiagonal(), q.transpose());
    return 0.5 * (w + w.transpose());
  }

private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

/// Boxes, unilateral rows, friction without and with a dashpot, among bilateral rows, in no order.
inline Problem random_problem(Random& random, int bilateral, int bounded, double friction, double decades = 2) {
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

inline double press(const ContactRow& row, const VectorXd& lambda) {
  double square = 0;
  for (const int n : row.normal) square += n >= 0 ? lambda[n] * lambda[n] : 0;
  return row.friction * std::sqrt(square);
}

inline VectorXd motion(const Problem& p, const VectorXd& lambda) {
  VectorXd u = p.w * lambda + p.delta;
  for (int i = 0; i < p.size(); ++i) u[i] += p.row(i).compliance * lambda[i];
  return u;
}

/// How far a row is from its law: bilateral |u|; else the smallest of the violations of its three branches. Motion is
/// counted as the force that would undo it.
inline double law_violation(const Problem& p, const VectorXd& lambda) {
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

inline VectorXd solve(BoundedSolver& solver, const Problem& p, VectorXd lambda,
                      BoundedSolveReport* report = nullptr) {
  const BoundedSolveReport r = solver.solve(p.rows, p.w, p.delta, lambda);
  if (report != nullptr) *report = r;
  return lambda;
}

inline VectorXd solve(const Problem& p, BoundedSolveReport* report = nullptr) {
  BoundedSolver solver(kMaxRows);
  return solve(solver, p, VectorXd::Zero(p.size()), report);
}

/// A tip on a surface under a needle that is held laterally by rows of its own.
inline Problem tip_problem(Random& random) {
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

}  // namespace stylet::physics::testing
