#include "physics/contact/bounded_solver.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

bool valid(std::span<const ContactRow> rows, int i) {
  const ContactRow& row = rows[i];
  const int count = static_cast<int>(rows.size());
  if (!(row.compliance >= 0) || !std::isfinite(row.compliance)) return false;
  if (row.bilateral) return true;
  if (row.normal[0] >= count || row.normal[1] >= count || row.across >= count) return false;
  if (row.across >= 0) {
    const ContactRow& other = rows[row.across];
    if (row.across == i || other.across != i || other.bilateral || row.viscosity != other.viscosity ||
        !(row.upper >= 0)) {
      return false;
    }
  }
  return row.lower <= row.upper && row.lower < std::numeric_limits<double>::infinity() &&
         row.upper > -std::numeric_limits<double>::infinity() && row.viscosity >= 0 && std::isfinite(row.viscosity) &&
         row.friction >= 0 && std::isfinite(row.friction);
}

bool pressed(const ContactRow& row) {
  return !row.bilateral && row.friction > 0 && (row.normal[0] >= 0 || row.normal[1] >= 0);
}

/// The law solved for one multiplier: lambda with u = r + s lambda.
double single_row(double s, double r, double lower, double upper, double viscosity, double viscosity_upper) {
  const double sticking = -r / s;
  if (sticking > upper) return (upper - viscosity_upper * r) / (1 + viscosity_upper * s);
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

ContactRow disc_row(std::uint64_t id, int across, double adhesion, double friction, std::array<int, 2> normal,
                    double compliance, double viscosity) {
  ContactRow row = friction_row(id, adhesion, friction, normal, viscosity, compliance);
  row.across = across;
  return row;
}

BoundedSolver::BoundedSolver(int max_rows) : elimination_(max_rows), pivoting_(max_rows) {
  const auto n = static_cast<std::size_t>(max_rows);
  const Eigen::Index padded = max_rows + 2 * PanelLdl::kPanel;
  leading_.reserve(n);
  bounded_.reserve(n);
  place_.resize(n);
  schur_ = Eigen::MatrixXd::Zero(max_rows, max_rows);
  coupling_ = press_gradient_ = Eigen::MatrixXd::Zero(padded, padded);
  newton_ = Eigen::MatrixXd::Zero(padded + max_rows / 2, padded + max_rows / 2);
  for (Eigen::VectorXd* v :
       {&reduced_, &work_, &multipliers_, &motion_, &compliance_, &lambda_, &u_, &press_, &pressed_, &newton_step_}) {
    *v = Eigen::VectorXd::Zero(padded + max_rows / 2);
  }
  for (std::vector<double>* v : {&softening_, &diagonal_, &lower_, &upper_, &viscosity_, &viscosity_upper_,
                                 &base_lower_, &base_upper_, &yielding_}) {
    v->resize(n + PanelLdl::kPanel);
  }
  for (std::vector<RowState>* v : {&reduced_states_, &newton_states_, &states_}) v->resize(n);
  newton_pivots_.resize(n + n / 2);
  discs_.reserve(n / 2);
  sliding_discs_.reserve(n / 2);
  remembered_ids_.reserve(n);
  remembered_states_.reserve(n);
  remembered_yielding_.reserve(n);
}

void BoundedSolver::forget() {
  remembered_ids_.clear();
  remembered_states_.clear();
  remembered_yielding_.clear();
}

BoundedSolveReport BoundedSolver::solve(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                                        const Eigen::Ref<const Eigen::VectorXd>& delta,
                                        Eigen::Ref<Eigen::VectorXd> lambda) noexcept {
  BoundedSolveReport report;
  count_ = 0;
  if (rows.size() > place_.size()) return report;
  count_ = static_cast<int>(rows.size());
  if (!eliminate(rows, w, delta, report)) return report;
  report.solved = true;
  for (int i = 0; i < count_; ++i) multipliers_[i] = std::isfinite(lambda[i]) ? lambda[i] : 0;
  recall_states(rows);
  if (!solve_bounds(rows, false, report)) {
    for (int i = 0; i < count_; ++i) multipliers_[i] = std::isfinite(lambda[i]) ? lambda[i] : 0;
    report.lagged_bounds = solve_bounds(rows, true, report);
    report.fallback = !report.lagged_bounds;
    for (int i = 0; i < limits_.sweeps && report.fallback; ++i) sweep(rows);
  }
  report.residual = residual(rows, w, delta);
  settle_motion(rows);
  lambda.head(count_) = multipliers_.head(count_);
  remember_states(rows);
  return report;
}

bool BoundedSolver::eliminate(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                              const Eigen::Ref<const Eigen::VectorXd>& delta, BoundedSolveReport& report) {
  leading_.clear();
  bounded_.clear();
  has_coupling_ = false;
  for (int i = 0; i < count_; ++i) {
    const ContactRow& row = rows[i];
    if (!valid(rows, i) || !std::isfinite(delta[i])) return false;
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
  for (int j = 0; j < leading; ++j) {
    compliance_[leading_[j]] += softening_[j];
    report.smallest_pivot = std::min(report.smallest_pivot, elimination_.pivot(j));
  }
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
    viscosity_upper_[j] = row.viscous_upper ? row.viscosity : 0;
  }
  discs_.clear();
  for (int j = 0; j < bounded; ++j) {
    const int across = rows[bounded_[j]].across;
    if (across > bounded_[j]) discs_.push_back({j, place_[across]});
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
    yielding_[j] = 0;
    for (std::size_t tried = 0; tried < known; ++tried) {
      const std::size_t at = next;
      next = next + 1 == known ? 0 : next + 1;
      if (remembered_ids_[at] != id) continue;
      reduced_states_[j] = remembered_states_[at];
      yielding_[j] = rows[bounded_[j]].across >= 0 ? remembered_yielding_[at] : 0;
      break;
    }
  }
}

void BoundedSolver::remember_states(std::span<const ContactRow> rows) {
  remembered_ids_.clear();
  remembered_states_.clear();
  remembered_yielding_.clear();
  std::fill_n(states_.begin(), count_, RowState::sticking);
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    states_[bounded_[j]] = yielding_[j] > 0 ? RowState::upper : reduced_states_[j];
    remembered_ids_.push_back(rows[bounded_[j]].id);
    remembered_states_.push_back(reduced_states_[j]);
    remembered_yielding_.push_back(yielding_[j]);
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

/// Projected Gauss-Seidel on the bounded rows, the bilateral ones exact: the fall-back.
void BoundedSolver::sweep(std::span<const ContactRow> rows) {
  const int bounded = static_cast<int>(bounded_.size());
  const double* d = reduced_.data() + elimination_.trailing_start();
  held_ = false;
  if (!lambda_.head(bounded).allFinite()) lambda_.head(bounded).setZero();
  recover_leading();
  const auto motion = [&](int j) { return schur_.col(j).head(bounded).dot(lambda_.head(bounded)) + d[j]; };
  for (int j = 0; j < bounded; ++j) {
    if (rows[bounded_[j]].across >= 0) continue;
    const double p = press(rows[bounded_[j]]);
    const double s = schur_(j, j);
    const double others = motion(j) - s * lambda_[j];
    const double lower = base_lower_[j] - p;
    const double upper = base_upper_[j] + p;
    lambda_[j] = single_row(s, others, lower, upper, viscosity_[j], viscosity_upper_[j]);
    reduced_states_[j] = -others > s * upper   ? RowState::upper
                         : -others < s * lower ? RowState::lower
                                               : RowState::sticking;
  }
  for (const auto& [j, k] : discs_) {
    const double s = std::max(schur_(j, j), schur_(k, k));
    const Eigen::Vector2d sticking(lambda_[j] - motion(j) / s, lambda_[k] - motion(k) / s);
    const double length = sticking.norm();
    const double bound = radius(rows, {j, k});
    const double held = (bound + viscosity_[j] * s * length) / (1 + viscosity_[j] * s);
    const double shortened = length > bound ? held / length : 1;
    lambda_[j] = shortened * sticking[0];
    lambda_[k] = shortened * sticking[1];
    reduced_states_[j] = reduced_states_[k] = RowState::sticking;
    yielding_[j] = yielding_[k] = bound > 0 ? s * (1 / shortened - 1) : 0;
  }
  recover_leading();
}

/// What the states say about the motion, without its rounding: a caller that adds it up over steps sees no creep of
/// what sticks, and friction takes energy to the last bit.
void BoundedSolver::settle_motion(std::span<const ContactRow> rows) {
  for (const int i : leading_) motion_[i] = 0;
  for (std::size_t j = 0; j < bounded_.size(); ++j) {
    double& u = motion_[bounded_[j]];
    if (rows[bounded_[j]].across >= 0 && lower_[j] == upper_[j]) continue;  // a disc without radius slides freely
    if (reduced_states_[j] == RowState::sticking) u = -yielding_[j] * multipliers_[bounded_[j]];
    if (reduced_states_[j] == RowState::upper) u = std::min(u, 0.0);
    if (reduced_states_[j] == RowState::lower) u = std::max(u, 0.0);
  }
}

double BoundedSolver::residual(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                               const Eigen::Ref<const Eigen::VectorXd>& delta) {
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
    if (row.across >= 0) {
      const int k = row.across;
      const double softest = std::max(yielding, w(k, k) + compliance_[k]);
      const Eigen::Vector2d force =
          Eigen::Vector2d(lambda[i], lambda[k]) + row.viscosity * Eigen::Vector2d(u[i], u[k]);
      Eigen::Vector2d law = force - Eigen::Vector2d(u[i], u[k]) / softest;
      const double bound = row.upper + press(row);
      if (law.norm() > bound) law *= bound / law.norm();
      distance = (force - law).norm() / (1 + row.viscosity * softest);
    } else if (!row.bilateral) {
      const double p = press(row);
      const double k = u[i] > 0 || row.viscous_upper ? row.viscosity : 0;
      const double y = lambda[i] + k * u[i];
      const double y_law = std::min(std::max(y - u[i] / yielding, row.lower - p), row.upper + p);
      distance = std::abs(y - y_law) / (1 + k * yielding);
    }
    worst = std::max(worst, distance);
  }
  return largest > 0 ? worst / largest : 0;
}

}  // namespace stylet::physics
