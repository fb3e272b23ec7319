// Bounds that depend on the multipliers: Newton's method round the exact solve for given bounds.
#include "physics/contact/bounded_solver.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr double kTolerance = 1e-13;      // of the largest bound's variable part
constexpr double kStall = 1e-10;          // where rounding may end the gains
constexpr double kForceRounding = 1e-15;  // of the largest force
constexpr double kChordRate = 1e-2;       // a Newton matrix is kept while each step gains this much
constexpr double kGain = 0.9;             // what a step has to gain for the next to be Newton's
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

/// @param held  bounds stay as the multipliers at hand give them; only discs are left to iterate
bool BoundedSolver::solve_bounds(std::span<const ContactRow> rows, bool held, BoundedSolveReport& report) {
  const int bounded = static_cast<int>(bounded_.size());
  for (int j = 0; j < bounded; ++j) press_[j] = press(rows[bounded_[j]]);
  held_ = held;
  const int most_pivots = report.pivots + limits_.pivots;
  const int most_updates = report.bound_updates + limits_.bound_updates;
  double last_error = kInfinity;
  int plain_steps = 0;
  int plain_run = 1;
  has_newton_ = false;
  for (;;) {
    set_bounds(rows);
    if (!pivot(report, most_pivots)) return false;
    const auto [error, scale] = bound_error(rows);
    const bool gained = error < kGain * last_error;
    if (error <= kTolerance * scale || (!gained && error <= kStall * scale)) return true;
    if (!std::isfinite(error) || report.bound_updates == most_updates) return false;
    ++report.bound_updates;

    // Newton on P(lambda(P)) = P. After a step that gained nothing, the plain iteration P <- P(lambda), each time for
    // twice as long: it gets past changes of states that the derivative does not see.
    if (!gained && plain_steps == 0) plain_steps = plain_run = 2 * plain_run;
    if (plain_steps > 0) {
      --plain_steps;
      last_error = kInfinity;
      plain_update(rows);
      continue;
    }
    const bool keep = has_newton_ && discs_.empty() && error < kChordRate * last_error &&
                      std::equal(newton_states_.begin(), newton_states_.begin() + bounded, reduced_states_.begin());
    if (!keep) {
      linearise_press(rows);
      has_newton_ = factorise_newton(rows);
    }
    last_error = error;
    if (has_newton_) {
      newton_update(rows);
    } else {
      plain_update(rows);
    }
  }
}

/// The bound of a disc's force.
double BoundedSolver::radius(std::span<const ContactRow> rows, const std::array<int, 2>& disc) const {
  const ContactRow& row = rows[bounded_[disc[0]]];
  return row.upper + (held_ ? press_[disc[0]] : press(row));
}

/// What a disc's force is while it slides as it yields now: beyond its bound where it is viscous.
double BoundedSolver::sliding_force(std::span<const ContactRow> rows, const std::array<int, 2>& disc) const {
  return radius(rows, disc) / (1 - viscosity_[disc[0]] * yielding_[disc[0]]);
}

void BoundedSolver::set_bounds(std::span<const ContactRow> rows) {
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    lower_[j] = base_lower_[j] - press_[j];
    upper_[j] = base_upper_[j] + press_[j];
  }
  for (const auto& [j, k] : discs_) {
    const double open = radius(rows, {j, k}) > 0 ? kInfinity : 0;
    lower_[j] = lower_[k] = -open;
    upper_[j] = upper_[k] = open;
    if (open > 0) reduced_states_[j] = reduced_states_[k] = RowState::sticking;
  }
}

bool BoundedSolver::pivot(BoundedSolveReport& report, int most_pivots) {
  const int bounded = static_cast<int>(bounded_.size());
  const BoxPivoting::Problem problem{.s = schur_.topLeftCorner(bounded, bounded),
                                     .d = reduced_.data() + elimination_.trailing_start(),
                                     .lower = lower_.data(),
                                     .upper = upper_.data(),
                                     .viscosity = viscosity_.data(),
                                     .viscosity_upper = viscosity_upper_.data(),
                                     .yielding = yielding_.data()};
  const bool found = pivoting_.solve(problem, reduced_states_.data(), lambda_, u_, most_pivots, report.pivots);
  if (found) recover_leading();
  return found;
}

BoundedSolver::BoundError BoundedSolver::bound_error(std::span<const ContactRow> rows) {
  BoundError e;
  for (int j = 0; j < static_cast<int>(bounded_.size()); ++j) {
    const ContactRow& row = rows[bounded_[j]];
    if (row.across >= 0) continue;
    pressed_[j] = held_ ? press_[j] : press(row);
    e.error = std::max(e.error, std::abs(pressed_[j] - press_[j]));
    e.scale = std::max(e.scale, pressed_[j]);
  }
  for (const auto& [j, k] : discs_) {
    const double bound = sliding_force(rows, {j, k});
    const double force = std::hypot(lambda_[j], lambda_[k]);
    const bool shut = lower_[j] == upper_[j];
    const double error = shut ? bound : yielding_[j] > 0 || force > bound ? std::abs(force - bound) : 0;
    e.error = std::max(e.error, error);
    e.scale = std::max(e.scale, bound);
  }
  if (e.scale > 0) e.scale += kForceRounding / kTolerance * multipliers_.head(count_).lpNorm<Eigen::Infinity>();
  return e;
}

void BoundedSolver::plain_update(std::span<const ContactRow> rows) {
  press_.head(static_cast<Eigen::Index>(bounded_.size())) = pressed_.head(static_cast<Eigen::Index>(bounded_.size()));
  for (const auto& disc : discs_) yield(disc, radius(rows, disc));
}

/// As if nothing else moved: |lambda| (s + g) stays, on the bound b + k g |lambda|.
void BoundedSolver::yield(const std::array<int, 2>& disc, double bound) {
  const auto& [j, k] = disc;
  if (!(bound > 0)) return;
  const double s = 0.5 * (schur_(j, j) + schur_(k, k));
  const double over = std::hypot(lambda_[j], lambda_[k]) / bound;
  const double stuck = (s + yielding_[j]) * over;
  yielding_[j] = yielding_[k] = std::max(0.0, stuck - s) / (1 + viscosity_[j] * stuck);
}

void BoundedSolver::newton_update(std::span<const ContactRow> rows) {
  const int bounded = static_cast<int>(bounded_.size());
  auto step = newton_step_.head(newton_size_);
  step.setZero();
  for (int j = 0; j < bounded; ++j) {
    if (rows[bounded_[j]].across >= 0) continue;
    step[j] = static_cast<int>(reduced_states_[j]) * (pressed_[j] - press_[j]);
  }
  for (std::size_t a = 0; a < sliding_discs_.size(); ++a) {
    const auto& [j, k] = discs_[sliding_discs_[a]];
    const double bound = sliding_force(rows, {j, k});
    const double force = std::hypot(lambda_[j], lambda_[k]);
    step[bounded + static_cast<int>(a)] = force * (bound - force) / bound;
  }
  solve_newton(newton_step_);
  const auto rows_step = newton_step_.head(bounded);
  for (int j = 0; j < bounded; ++j) {
    if (rows[bounded_[j]].across >= 0) continue;
    press_[j] = std::max(0.0, pressed_[j] + press_gradient_.col(j).head(bounded).dot(rows_step));
  }
  for (std::size_t a = 0; a < sliding_discs_.size(); ++a) {
    const auto& [j, k] = discs_[sliding_discs_[a]];
    const double step_g = newton_step_[bounded + static_cast<int>(a)];
    const double bound = radius(rows, {j, k});
    const bool viscous = viscosity_[j] * (yielding_[j] + step_g) >= 1;  // beyond what any force asks for
    if ((std::hypot(lambda_[j], lambda_[k]) - sliding_force(rows, {j, k})) * step_g > 0 && !viscous) {
      yielding_[j] = yielding_[k] = std::max(0.0, yielding_[j] + step_g);
    } else {  // too much force asks for more yielding, whatever the derivative says
      yield({j, k}, bound);
    }
  }
}

/// dP_i / dlambda_t, with the lateral multipliers following: dlambda_n = -W_nn^-1 W_nt dlambda_t.
void BoundedSolver::linearise_press(std::span<const ContactRow> rows) {
  const int bounded = static_cast<int>(bounded_.size());
  for (int j = 0; j < bounded; ++j) {
    const ContactRow& row = rows[bounded_[j]];
    auto gradient = press_gradient_.col(j).head(bounded);
    gradient.setZero();
    const double p = press(row);
    if (held_ || !(p > 0)) continue;
    for (const int n : row.normal) {
      if (n < 0) continue;
      const double weight = row.friction * row.friction * multipliers_[n] / p;
      if (!rows[n].bilateral) {
        gradient[place_[n]] += weight;
        continue;
      }
      if (!has_coupling_) elimination_.coupling(coupling_);
      has_coupling_ = true;
      gradient -= weight * coupling_.col(place_[n]).head(bounded);
    }
  }
}

/// L U, equations as columns, of the law's derivative in the present states; dg of sliding discs behind the rows:
///   sticking  (S dlambda)_i = 0
///   sliding   dlambda_i -+ dP_i + k (S dlambda)_i = +- (P(lambda) - P)_i
///   disc      (S dlambda)_i + g dlambda_i + lambda_i dg = 0, and 1/|lambda| - (1 - k g)/b = 0, nearly linear in g
bool BoundedSolver::factorise_newton(std::span<const ContactRow> rows) {
  const int bounded = static_cast<int>(bounded_.size());
  sliding_discs_.clear();
  for (std::size_t a = 0; a < discs_.size(); ++a) {
    const auto& [j, k] = discs_[a];
    const double bound = radius(rows, discs_[a]);
    const bool shut = lower_[j] == upper_[j];
    if (!shut && bound > 0 && (yielding_[j] > 0 || std::hypot(lambda_[j], lambda_[k]) > bound)) {
      sliding_discs_.push_back(static_cast<int>(a));
    }
  }
  const int n = newton_size_ = bounded + static_cast<int>(sliding_discs_.size());
  for (int i = 0; i < bounded; ++i) {
    auto equation = newton_.col(i).head(n);
    newton_states_[i] = reduced_states_[i];
    equation.tail(n - bounded).setZero();
    if (reduced_states_[i] == RowState::sticking) {
      equation.head(bounded) = schur_.col(i).head(bounded) / schur_(i, i);
      equation[i] += yielding_[i] / schur_(i, i);
      continue;
    }
    equation.head(bounded).setZero();
    if (rows[bounded_[i]].across < 0) {
      equation.head(bounded) = -static_cast<double>(reduced_states_[i]) * press_gradient_.col(i).head(bounded);
      const double k = reduced_states_[i] == RowState::upper ? viscosity_upper_[i] : viscosity_[i];
      if (k > 0) equation.head(bounded) += k * schur_.col(i).head(bounded);
    }
    equation[i] += 1;
  }
  for (int a = bounded; a < n; ++a) {
    const auto& [j, k] = discs_[sliding_discs_[a - bounded]];
    const double force = std::hypot(lambda_[j], lambda_[k]);
    const double bound = radius(rows, {j, k});
    const double over = force / bound;
    const double held = 1 - viscosity_[j] * yielding_[j];
    newton_(a, j) = lambda_[j] / schur_(j, j);
    newton_(a, k) = lambda_[k] / schur_(k, k);
    auto equation = newton_.col(a).head(n);
    equation.setZero();
    equation.head(bounded) = -held * over * over * press_gradient_.col(j).head(bounded);
    equation[a] = -force * over * viscosity_[j];
    equation[j] += lambda_[j] / force;
    equation[k] += lambda_[k] / force;
  }
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(newton_(k, i)) > std::abs(newton_(k, best))) best = i;
    }
    newton_pivots_[k] = best;
    if (best != k) newton_.col(k).head(n).swap(newton_.col(best).head(n));
    const double pivot = newton_(k, k);
    if (!std::isfinite(pivot) || pivot == 0) return false;
    const int rest = n - k - 1;
    for (int i = k + 1; i < n; ++i) {
      const double factor = newton_(k, i) /= pivot;
      if (factor != 0) newton_.col(i).segment(k + 1, rest) -= factor * newton_.col(k).segment(k + 1, rest);
    }
  }
  return true;
}

void BoundedSolver::solve_newton(Eigen::VectorXd& x) const {
  const int n = newton_size_;
  for (int k = 0; k < n; ++k) std::swap(x[k], x[newton_pivots_[k]]);
  for (int i = 1; i < n; ++i) x[i] -= newton_.col(i).head(i).dot(x.head(i));
  for (int k = n; k-- > 0;) {
    const int rest = n - k - 1;
    x[k] = (x[k] - newton_.col(k).segment(k + 1, rest).dot(x.segment(k + 1, rest))) / newton_(k, k);
  }
}

}  // namespace stylet::physics
