#include "physics/contact/bounded_solver.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr double kBoundTolerance = 1e-12;  // of the largest normal force's friction
constexpr double kBoundRounding = 1e-15;   // of the largest force
constexpr double kChordRate = 1e-2;        // a Newton matrix is kept while each step gains this much
constexpr double kGain = 0.9;              // what a Newton step has to gain for the next to be one too

bool valid(const ContactRow& row, int count) {
  if (!(row.compliance >= 0) || !std::isfinite(row.compliance)) return false;
  if (row.bilateral) return true;
  for (const int n : row.normal) {
    if (n >= count) return false;
  }
  return row.lower <= row.upper && row.lower < std::numeric_limits<double>::infinity() &&
         row.upper > -std::numeric_limits<double>::infinity() && row.viscosity >= 0 && std::isfinite(row.viscosity) &&
         row.friction >= 0 && std::isfinite(row.friction);
}

bool pressed(const ContactRow& row) {
  return !row.bilateral && row.friction > 0 && (row.normal[0] >= 0 || row.normal[1] >= 0);
}

/// The law solved for one multiplier: lambda with u = r + s lambda.
double single_row(double s, double r, double lower, double upper, double viscosity) {
  const double sticking = -r / s;
  if (sticking > upper) return (upper - viscosity * r) / (1 + viscosity * s);
  if (sticking < lower) return (lower - viscosity * r) / (1 + viscosity * s);
  return sticking;
}

}  // namespace

ContactRow bilateral_row(std::uint64_t id, double compliance) {
  return {.id = id, .compliance = compliance};
}

ContactRow unilateral_row(std::uint64_t id, double compliance) {
  return box_row(id, 0, std::numeric_limits<double>::infinity(), compliance);
}

ContactRow box_row(std::uint64_t id, double lower, double upper, double compliance) {
  return {.id = id, .bilateral = false, .compliance = compliance, .lower = lower, .upper = upper};
}

ContactRow friction_row(std::uint64_t id, double adhesion, double friction, std::array<int, 2> normal,
                        double viscosity, double compliance) {
  return {.id = id,
          .bilateral = false,
          .compliance = compliance,
          .lower = -adhesion,
          .upper = adhesion,
          .viscosity = viscosity,
          .friction = friction,
          .normal = normal};
}

BoundedSolver::BoundedSolver(int max_rows) : elimination_(max_rows), pivoting_(max_rows) {
  const auto n = static_cast<std::size_t>(max_rows);
  const Eigen::Index padded = max_rows + 2 * PanelLdl::kPanel;
  leading_.reserve(n);
  bounded_.reserve(n);
  place_.resize(n);
  schur_ = Eigen::MatrixXd::Zero(max_rows, max_rows);
  coupling_ = press_gradient_ = newton_ = Eigen::MatrixXd::Zero(padded, padded);
  for (Eigen::VectorXd* v :
       {&reduced_, &work_, &multipliers_, &motion_, &compliance_, &lambda_, &u_, &press_, &pressed_, &newton_step_}) {
    *v = Eigen::VectorXd::Zero(padded);
  }
  for (std::vector<double>* v :
       {&softening_, &diagonal_, &lower_, &upper_, &viscosity_, &base_lower_, &base_upper_}) {
    v->resize(n + PanelLdl::kPanel);
  }
  for (std::vector<RowState>* v : {&reduced_states_, &newton_states_, &states_}) v->resize(n);
  newton_pivots_.resize(n);
  remembered_ids_.reserve(n);
  remembered_states_.reserve(n);
}

void BoundedSolver::forget() {
  remembered_ids_.clear();
  remembered_states_.clear();
}

BoundedSolveReport BoundedSolver::solve(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                                        Eigen::Ref<const Eigen::VectorXd> delta,
                                        Eigen::Ref<Eigen::VectorXd> lambda) noexcept {
  BoundedSolveReport report;
  count_ = 0;
  if (rows.size() > place_.size()) return report;
  count_ = static_cast<int>(rows.size());
  if (!eliminate(rows, w, delta, report)) return report;
  report.solved = true;
  for (int i = 0; i < count_; ++i) multipliers_[i] = std::isfinite(lambda[i]) ? lambda[i] : 0;
  recall_states(rows);
  if (!solve_bounds(rows, report)) {
    report.fallback = true;
    for (int i = 0; i < limits_.sweeps; ++i) sweep(rows);
  }
  report.residual = residual(rows, w, delta);
  settle_motion();
  lambda.head(count_) = multipliers_.head(count_);
  remember_states(rows);
  return report;
}

bool BoundedSolver::eliminate(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                              Eigen::Ref<const Eigen::VectorXd> delta, BoundedSolveReport& report) {
  leading_.clear();
  bounded_.clear();
  has_coupling_ = false;
  for (int i = 0; i < count_; ++i) {
    const ContactRow& row = rows[i];
    if (!valid(row, count_) || !std::isfinite(delta[i])) return false;
    std::vector<int>& group = row.bilateral ? leading_ : bounded_;
    place_[i] = static_cast<int>(group.size());
    group.push_back(i);
    compliance_[i] = row.compliance;
  }
  const int leading = static_cast<int>(leading_.size());
  const int bounded = static_cast<int>(bounded_.size());
  elimination_.resize(leading, bounded);
  const int start = elimination_.trailing_start();
  for (int j = 0; j < leading; ++j) {
    double* column = elimination_.column(j);
    const int from = leading_[j];
    for (int i = j; i < leading; ++i) column[i] = w(leading_[i], from);
    for (int i = 0; i < bounded; ++i) {
      column[start + i] = bounded_[i] > from ? w(bounded_[i], from) : w(from, bounded_[i]);
    }
    column[j] += compliance_[from];
  }
  for (int j = 0; j < bounded; ++j) {
    double* column = elimination_.column(start + j) + start;
    for (int i = j; i < bounded; ++i) column[i] = w(bounded_[i], bounded_[j]);
    column[j] += compliance_[bounded_[j]];
    diagonal_[j] = column[j];
  }

  const int softened = elimination_.factorise(softening_.data());
  if (softened < 0) return false;
  for (int j = 0; j < leading; ++j) compliance_[leading_[j]] += softening_[j];
  for (int j = 0; j < bounded; ++j) {
    const double* column = elimination_.column(start + j) + start;
    for (int i = j; i < bounded; ++i) schur_(i, j) = schur_(j, i) = column[i];
  }
  const int dependent = pivoting_.load(schur_.topLeftCorner(bounded, bounded), diagonal_.data(), softening_.data());
  if (dependent < 0) return false;
  for (int j = 0; j < bounded; ++j) compliance_[bounded_[j]] += softening_[j];
  report.softened_rows = softened + dependent;

  reduced_.head(elimination_.size()).setZero();
  for (int j = 0; j < leading; ++j) reduced_[j] = delta[leading_[j]];
  for (int j = 0; j < bounded; ++j) {
    const ContactRow& row = rows[bounded_[j]];
    reduced_[start + j] = delta[bounded_[j]];
    base_lower_[j] = row.lower;
    base_upper_[j] = row.upper;
    viscosity_[j] = row.viscosity;
  }
  elimination_.forward(reduced_.data());
  return true;
}

void BoundedSolver::recall_states(std::span<const ContactRow> rows) {
  const std::size_t known = remembered_ids_.size();
  std::size_t next = 0;  // rows mostly come in the order of the last solve
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    const std::uint64_t id = rows[bounded_[j]].id;
    reduced_states_[j] = RowState::sticking;
    for (std::size_t tried = 0; tried < known; ++tried) {
      const std::size_t at = next;
      next = next + 1 == known ? 0 : next + 1;
      if (remembered_ids_[at] != id) continue;
      reduced_states_[j] = remembered_states_[at];
      break;
    }
  }
}

void BoundedSolver::remember_states(std::span<const ContactRow> rows) {
  remembered_ids_.clear();
  remembered_states_.clear();
  std::fill_n(states_.begin(), count_, RowState::sticking);
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    states_[bounded_[j]] = reduced_states_[j];
    remembered_ids_.push_back(rows[bounded_[j]].id);
    remembered_states_.push_back(reduced_states_[j]);
  }
}

double BoundedSolver::press(const ContactRow& row) const {
  if (!pressed(row)) return 0;
  double square = 0;
  for (const int n : row.normal) {
    if (n >= 0) square += multipliers_[n] * multipliers_[n];
  }
  return row.friction * std::sqrt(square);
}

void BoundedSolver::spread_bounds() {
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    lower_[j] = base_lower_[j] - press_[j];
    upper_[j] = base_upper_[j] + press_[j];
  }
}

/// W_nn lambda_n = -delta_n - W_nt lambda_t
void BoundedSolver::recover_leading() {
  const int start = elimination_.trailing_start();
  const int bounded = static_cast<int>(bounded_.size());
  work_.head(elimination_.size()).setZero();
  for (std::size_t j = 0; j < leading_.size(); ++j) work_[j] = -reduced_[j] / elimination_.pivot(static_cast<int>(j));
  work_.segment(start, bounded) = lambda_.head(bounded);
  elimination_.backward(work_.data());
  for (std::size_t j = 0; j < leading_.size(); ++j) multipliers_[leading_[j]] = work_[j];
  for (int j = 0; j < bounded; ++j) multipliers_[bounded_[j]] = lambda_[j];
}

bool BoundedSolver::solve_bounds(std::span<const ContactRow> rows, BoundedSolveReport& report) {
  const int bounded = static_cast<int>(bounded_.size());
  const auto schur = schur_.topLeftCorner(bounded, bounded);
  const double* d = reduced_.data() + elimination_.trailing_start();
  for (int j = 0; j < bounded; ++j) press_[j] = press(rows[bounded_[j]]);
  double last_error = std::numeric_limits<double>::infinity();
  bool has_newton = false;
  for (;;) {
    spread_bounds();
    if (!pivoting_.solve(schur, d, {lower_.data(), upper_.data(), viscosity_.data()}, reduced_states_.data(), lambda_,
                         u_, limits_.pivots, report.pivots)) {
      return false;
    }
    recover_leading();
    double error = 0;
    double scale = 0;
    for (int j = 0; j < bounded; ++j) {
      pressed_[j] = press(rows[bounded_[j]]);
      error = std::max(error, std::abs(pressed_[j] - press_[j]));
      scale = std::max(scale, pressed_[j]);
    }
    if (scale > 0) scale += kBoundRounding / kBoundTolerance * multipliers_.head(count_).lpNorm<Eigen::Infinity>();
    if (error <= kBoundTolerance * scale) return true;
    if (!std::isfinite(error) || report.bound_updates == limits_.bound_updates) return false;
    ++report.bound_updates;

    // Newton on P(lambda(P)) = P; the plain iteration P <- P(lambda) where it gained nothing.
    const bool gained = error < kGain * last_error;
    if (gained && !(has_newton && error < kChordRate * last_error &&
                    std::equal(newton_states_.begin(), newton_states_.begin() + bounded, reduced_states_.begin()))) {
      linearise_press(rows);
      has_newton = factorise_newton(rows);
    }
    last_error = gained ? error : std::numeric_limits<double>::infinity();
    if (!gained || !has_newton) {
      press_.head(bounded) = pressed_.head(bounded);
      continue;
    }
    for (int j = 0; j < bounded; ++j) {
      newton_step_[j] = static_cast<int>(reduced_states_[j]) * (pressed_[j] - press_[j]);
    }
    solve_newton(newton_step_);
    const auto step = newton_step_.head(bounded);
    for (int j = 0; j < bounded; ++j) {
      press_[j] = std::max(0.0, pressed_[j] + press_gradient_.col(j).head(bounded).dot(step));
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
    if (!(p > 0)) continue;
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

/// L U, equations as columns, of the law's derivative in the present states:
///   sticking (S dlambda)_i = 0,  sliding dlambda_i -+ dP_i + k (S dlambda)_i = +- (P(lambda) - P)_i
bool BoundedSolver::factorise_newton(std::span<const ContactRow> rows) {
  const int n = static_cast<int>(bounded_.size());
  for (int i = 0; i < n; ++i) {
    auto equation = newton_.col(i).head(n);
    newton_states_[i] = reduced_states_[i];
    if (reduced_states_[i] == RowState::sticking) {
      equation = schur_.col(i).head(n) / schur_(i, i);
      continue;
    }
    equation = -static_cast<double>(reduced_states_[i]) * press_gradient_.col(i).head(n);
    if (rows[bounded_[i]].viscosity > 0) equation += viscosity_[i] * schur_.col(i).head(n);
    equation[i] += 1;
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
  const int n = static_cast<int>(bounded_.size());
  for (int k = 0; k < n; ++k) std::swap(x[k], x[newton_pivots_[k]]);
  for (int i = 1; i < n; ++i) x[i] -= newton_.col(i).head(i).dot(x.head(i));
  for (int k = n; k-- > 0;) {
    const int rest = n - k - 1;
    x[k] = (x[k] - newton_.col(k).segment(k + 1, rest).dot(x.segment(k + 1, rest))) / newton_(k, k);
  }
}

/// Projected Gauss-Seidel on the bounded rows, the bilateral ones exact: the fall-back.
void BoundedSolver::sweep(std::span<const ContactRow> rows) {
  const int bounded = static_cast<int>(bounded_.size());
  const double* d = reduced_.data() + elimination_.trailing_start();
  if (!lambda_.head(bounded).allFinite()) lambda_.head(bounded).setZero();
  recover_leading();
  for (int j = 0; j < bounded; ++j) {
    const double p = press(rows[bounded_[j]]);
    const double s = schur_(j, j);
    const double others = schur_.col(j).head(bounded).dot(lambda_.head(bounded)) - s * lambda_[j] + d[j];
    const double lower = base_lower_[j] - p;
    const double upper = base_upper_[j] + p;
    lambda_[j] = single_row(s, others, lower, upper, viscosity_[j]);
    reduced_states_[j] = -others > s * upper   ? RowState::upper
                         : -others < s * lower ? RowState::lower
                                               : RowState::sticking;
  }
  recover_leading();
}

/// What the states say about the motion, without its rounding: a caller that adds it up over steps sees no creep of
/// what sticks, and friction takes energy to the last bit.
void BoundedSolver::settle_motion() {
  for (const int i : leading_) motion_[i] = 0;
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    double& u = motion_[bounded_[j]];
    if (reduced_states_[j] == RowState::sticking) u = 0;
    if (reduced_states_[j] == RowState::upper) u = std::min(u, 0.0);
    if (reduced_states_[j] == RowState::lower) u = std::max(u, 0.0);
  }
}

double BoundedSolver::residual(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                               Eigen::Ref<const Eigen::VectorXd> delta) {
  const auto lambda = multipliers_.head(count_);
  auto u = motion_.head(count_);
  u = delta + compliance_.head(count_).cwiseProduct(lambda);
  for (int j = 0; j < count_; ++j) {  // the lower triangle serves for both
    const int rest = count_ - j - 1;
    const auto below = w.col(j).tail(rest);
    u[j] += w(j, j) * lambda[j] + below.dot(lambda.tail(rest));
    u.tail(rest) += lambda[j] * below;
  }
  double largest = 0;
  double worst = 0;
  for (int i = 0; i < count_; ++i) {
    const ContactRow& row = rows[i];
    const double yielding = w(i, i) + compliance_[i];
    largest = std::max({largest, std::abs(lambda[i]), std::abs(delta[i]) / yielding});
    double distance = std::abs(u[i]) / yielding;
    if (!row.bilateral) {
      const double p = press(row);
      const double y = lambda[i] + row.viscosity * u[i];
      const double y_law = std::min(std::max(y - u[i] / yielding, row.lower - p), row.upper + p);
      distance = std::abs(y - y_law) / (1 + row.viscosity * yielding);
    }
    worst = std::max(worst, distance);
  }
  return largest > 0 ? worst / largest : 0;
}

}  // namespace stylet::physics
