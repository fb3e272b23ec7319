#include "physics/contact/organ_coupling.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::physics {
namespace {

constexpr int kMostPivots = 60;  // a step that needs more keeps the rows of the step before

}  // namespace

OrganCoupling::OrganCoupling()
    : w_(Eigen::MatrixXd::Zero(kMaxOrganRows, kMaxOrganRows)),
      gap_(Eigen::VectorXd::Zero(kMaxOrganRows)),
      lambda_0_(gap_),
      intercept_(gap_),
      free_change_(gap_),
      change_(gap_),
      pivoting_(kMaxOrganRows),
      factor_(kMaxOrganRows),
      softening_(kMaxOrganRows),
      diagonal_(kMaxOrganRows),
      zeros_(kMaxOrganRows, 0.0),
      unbounded_(kMaxOrganRows, std::numeric_limits<double>::infinity()),
      d_(gap_),
      next_lambda_(gap_),
      u_(gap_),
      column_(Eigen::VectorXd::Zero(kMaxOrganRows + 2 * PanelLdl::kPanel)) {}

void OrganCoupling::clear() {
  rows_ = carrying_ = 0;
}

void OrganCoupling::load(const OrganRows& rows) {
  const int before = rows_;
  old_ids_ = ids_;
  next_ = states_;
  rows_ = std::clamp(rows.count, 0, kMaxOrganRows);
  for (int i = 0; i < rows_; ++i) {
    ids_[i] = rows.ids[i];
    const auto old = std::find(old_ids_.begin(), old_ids_.begin() + before, ids_[i]);
    states_[i] = old != old_ids_.begin() + before ? next_[static_cast<std::size_t>(old - old_ids_.begin())]
                 : rows.lambda[i] > 0             ? RowState::sticking
                                                  : RowState::lower;
    diagonal_[i] = rows.w(i, i);
  }
  gap_.head(rows_) = rows.gap.head(rows_);
  lambda_0_.head(rows_) = rows.lambda.head(rows_);
  w_.topLeftCorner(rows_, rows_) = rows.w.topLeftCorner(rows_, rows_);
  const bool sound =
      rows_ == 0 || (gap_.head(rows_).allFinite() && lambda_0_.head(rows_).allFinite() &&
                     w_.topLeftCorner(rows_, rows_).allFinite() &&
                     pivoting_.load(w_.topLeftCorner(rows_, rows_), diagonal_.data(), softening_.data()) >= 0);
  if (!sound) rows_ = 0;
  intercept_.head(rows_) = gap_.head(rows_);
  intercept_.head(rows_).noalias() -= w_.topLeftCorner(rows_, rows_) * lambda_0_.head(rows_);
  factorise();
  change_.head(rows_) = free_change_.head(rows_);
}

void OrganCoupling::factorise() {
  carrying_ = 0;
  for (int i = 0; i < rows_; ++i) {
    if (states_[i] == RowState::sticking) active_[carrying_++] = i;
  }
  // W_AA d_A = -(gap_A + W_AI d_I), and the others carry nothing: d_I = -lambda_0.
  d_.head(rows_) = gap_.head(rows_);
  for (int i = 0; i < rows_; ++i) {
    if (states_[i] == RowState::sticking) continue;
    free_change_[i] = -lambda_0_[i];
    if (lambda_0_[i] != 0) d_.head(rows_) -= lambda_0_[i] * w_.col(i).head(rows_);
  }
  if (carrying_ == 0) return;
  factor_.resize(carrying_, 0);
  for (int b = 0; b < carrying_; ++b) {
    double* to = factor_.column(b);
    for (int a = b; a < carrying_; ++a) to[a] = w_(active_[a], active_[b]);
  }
  factor_.factorise(softening_.data());
  column_.head(factor_.size()).setZero();
  for (int a = 0; a < carrying_; ++a) column_[a] = -d_[active_[a]];
  factor_.solve(column_.data());
  for (int a = 0; a < carrying_; ++a) free_change_[active_[a]] = column_[a];
}

void OrganCoupling::openings(const TissuePatch& patch, int body, const PatchContact& point,
                             Eigen::Ref<Eigen::MatrixXd> y) const {
  y.setZero();
  const Eigen::MatrixXd& of_nodes = patch.organs.y[body];
  for (int k = 0; k < 4; ++k) {
    const Eigen::Index node = 3 * static_cast<Eigen::Index>(point.patch_nodes[k]);
    y += point.barycentric[k] * of_nodes.middleCols<3>(node).topRows(rows_);
  }
}

void OrganCoupling::fold(const Eigen::Ref<const Eigen::MatrixXd>& y, Eigen::Ref<Eigen::MatrixXd> z) {
  for (int c = 0; c < 3; ++c) {
    for (int a = 0; a < carrying_; ++a) column_[a] = y(active_[a], c);
    column_.segment(carrying_, factor_.size() - carrying_).setZero();
    factor_.forward(column_.data());
    for (int a = 0; a < carrying_; ++a) z(a, c) = column_[a] / std::sqrt(factor_.pivot(a));
  }
}

bool OrganCoupling::settle(const Eigen::Ref<const Eigen::VectorXd>& moved) {
  if (rows_ == 0) return false;
  d_.head(rows_) = intercept_.head(rows_) + moved;
  if (!d_.head(rows_).allFinite()) return false;
  next_ = states_;
  if (!solve_unilateral(pivoting_, w_.topLeftCorner(rows_, rows_), d_, zeros_, unbounded_, next_.data(), next_lambda_,
                        u_)) {
    return false;
  }
  change_.head(rows_) = next_lambda_.head(rows_) - lambda_0_.head(rows_);
  if (std::equal(next_.begin(), next_.begin() + rows_, states_.begin())) return false;
  states_ = next_;
  factorise();
  return true;
}

bool solve_unilateral(BoxPivoting& pivoting, const Eigen::Ref<const Eigen::MatrixXd>& w, const Eigen::VectorXd& d,
                      const std::vector<double>& zeros, const std::vector<double>& infinite, RowState* states,
                      Eigen::VectorXd& lambda, Eigen::VectorXd& u) {
  int pivots = 0;
  return pivoting.solve({.s = w,
                         .d = d.data(),
                         .lower = zeros.data(),
                         .upper = infinite.data(),
                         .viscosity = zeros.data(),
                         .viscosity_upper = zeros.data(),
                         .yielding = zeros.data()},
                        states, lambda, u, kMostPivots, pivots);
}

}  // namespace stylet::physics
