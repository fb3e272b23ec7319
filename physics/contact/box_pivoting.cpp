#include "physics/contact/box_pivoting.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr int kBlockCredit = 4;       // block pivots without progress before single ones
constexpr double kRounding = 1e-13;   // of the largest force or motion: a sign that counts as right
constexpr double kNoDashpot = 1e-18;  // k S_ii below which a dashpot carries nothing
constexpr double kNotInFactor = -1;

}  // namespace

BoxPivoting::BoxPivoting(int max_rows)
    : factor_(max_rows), x_(Eigen::VectorXd::Zero(max_rows + 2 * PanelLdl::kPanel)) {
  free_.reserve(max_rows);
  wrong_.reserve(max_rows);
  added_.resize(max_rows);
  softening_.resize(max_rows);
}

int BoxPivoting::load(Eigen::Ref<Eigen::MatrixXd> s, const double* diagonal, double* softening) {
  const int n = static_cast<int>(s.rows());
  std::fill(added_.begin(), added_.end(), kNotInFactor);
  free_.clear();
  if (n == 0) return 0;
  // What is left of a diagonal after elimination can be rounding alone, so dependence is judged against what it was:
  // first row by row here, then among the rows by the factor of all of them. Conditioning on fewer rows only makes
  // pivots larger, so with this factor sound every choice of states has one.
  int softened = 0;
  for (int i = 0; i < n; ++i) {
    softening[i] = 0;
    if (!std::isfinite(s(i, i)) || !(diagonal[i] > 0)) return -1;
    if (s(i, i) > PanelLdl::kLostDigits * diagonal[i]) continue;
    softening[i] = PanelLdl::kSoftening * diagonal[i] - s(i, i);
    s(i, i) += softening[i];
    ++softened;
  }
  factor_.resize(n, 0);
  for (int j = 0; j < n; ++j) std::copy_n(s.col(j).data() + j, n - j, factor_.column(j) + j);
  const int dependent = factor_.factorise(softening_.data());
  if (dependent < 0) return -1;
  if (dependent > 0) {
    for (int i = 0; i < n; ++i) {
      s(i, i) += softening_[i];
      softening[i] += softening_[i];
    }
  }
  std::fill_n(added_.begin(), n, 0.0);  // the factor of all rows sticking is at hand
  for (int i = 0; i < n; ++i) free_.push_back(i);
  return softened + dependent;
}

void BoxPivoting::factorise_free(const Problem& problem, const RowState* states) {
  const auto& s = problem.s;
  const int n = static_cast<int>(s.rows());
  bool same = true;
  for (int i = 0; i < n; ++i) {
    double added = problem.yielding[i];
    if (states[i] != RowState::sticking) {
      const double k = states[i] == RowState::upper ? problem.viscosity_upper[i] : problem.viscosity[i];
      added = k * s(i, i) > kNoDashpot ? 1 / k : kNotInFactor;
    }
    same = same && added == added_[i];
    added_[i] = added;
  }
  if (same) return;
  free_.clear();
  for (int i = 0; i < n; ++i) {
    if (added_[i] != kNotInFactor) free_.push_back(i);
  }
  const int count = static_cast<int>(free_.size());
  factor_.resize(count, 0);
  for (int b = 0; b < count; ++b) {
    const double* from = s.col(free_[b]).data();
    double* to = factor_.column(b);
    for (int a = b; a < count; ++a) to[a] = from[free_[a]];
    to[b] += added_[free_[b]];
  }
  factor_.factorise(softening_.data());
}

void BoxPivoting::solve_states(const Problem& problem, const RowState* states, Eigen::VectorXd& lambda,
                               Eigen::VectorXd& u) {
  const auto& s = problem.s;
  const int n = static_cast<int>(s.rows());
  factorise_free(problem, states);
  auto lambda_n = lambda.head(n);
  auto u_n = u.head(n);
  u_n = Eigen::Map<const Eigen::VectorXd>(problem.d, n);
  for (int i = 0; i < n; ++i) {
    lambda_n[i] = states[i] == RowState::sticking ? 0
                  : states[i] == RowState::upper  ? problem.upper[i]
                                                  : problem.lower[i];
    if (lambda_n[i] != 0) u_n += lambda_n[i] * s.col(i);
  }
  const int count = static_cast<int>(free_.size());
  if (count == 0) return;
  for (int a = 0; a < count; ++a) x_[a] = -u_n[free_[a]];
  x_.segment(count, factor_.size() - count).setZero();
  factor_.solve(x_.data());
  for (int a = 0; a < count; ++a) lambda_n[free_[a]] += x_[a];
  if (count < n) {
    for (int a = 0; a < count; ++a) u_n += x_[a] * s.col(free_[a]);
  }
  for (int a = 0; a < count; ++a) u_n[free_[a]] = -added_[free_[a]] * x_[a];  // 0 where it sticks
}

bool BoxPivoting::solve(const Problem& problem, RowState* states, Eigen::VectorXd& lambda, Eigen::VectorXd& u,
                        int most_pivots, int& pivots) {
  const auto& s = problem.s;
  const int n = static_cast<int>(s.rows());
  double d_scale = 0;
  double s_scale = 0;
  for (int i = 0; i < n; ++i) {
    if (states[i] == RowState::upper && !std::isfinite(problem.upper[i])) states[i] = RowState::sticking;
    if (states[i] == RowState::lower && !std::isfinite(problem.lower[i])) states[i] = RowState::sticking;
    // A box without width is a force that is given: nothing sticks, and no motion is wrong at it.
    if (problem.lower[i] == problem.upper[i] && states[i] == RowState::sticking) states[i] = RowState::upper;
    d_scale = std::max(d_scale, std::abs(problem.d[i]));
    s_scale = std::max(s_scale, s(i, i));
  }
  int fewest = n + 1;
  int credit = kBlockCredit;
  while (pivots < most_pivots) {
    solve_states(problem, states, lambda, u);
    ++pivots;
    const double force = n > 0 ? kRounding * lambda.head(n).lpNorm<Eigen::Infinity>() : 0;
    const double motion = kRounding * d_scale + s_scale * force;
    wrong_.clear();
    for (int i = 0; i < n; ++i) {
      if (problem.lower[i] == problem.upper[i]) {
        states[i] = u[i] > 0 ? RowState::lower : RowState::upper;
        continue;
      }
      const bool wrong = states[i] == RowState::sticking
                             ? lambda[i] > problem.upper[i] + force || lambda[i] < problem.lower[i] - force
                             : static_cast<int>(states[i]) * u[i] > motion;
      if (wrong) wrong_.push_back(i);
    }
    const int count = static_cast<int>(wrong_.size());
    if (count == 0) return true;
    const bool progress = count < fewest;
    if (progress) {
      fewest = count;
      credit = kBlockCredit;
    } else if (credit > 0) {
      --credit;
    }
    const bool block = progress || credit > 0;
    for (int w = block ? 0 : count - 1; w < count; ++w) {
      const int i = wrong_[w];
      states[i] = states[i] != RowState::sticking ? RowState::sticking
                  : lambda[i] > problem.upper[i]  ? RowState::upper
                                                  : RowState::lower;
    }
  }
  return false;
}

}  // namespace stylet::physics
