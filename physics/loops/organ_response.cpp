#include "physics/loops/organ_response.h"

#include "physics/contact/organ_coupling.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 2e-4;  // m: a row with this gap is half as likely to matter as one that carries force

/// Whether a row's compliance is known, and there is any.
bool known(const SurfaceRow& row, std::span<const OrganResponseBody> bodies) {
  bool any = false;
  for (int s = 0; s < row.support_count; ++s) {
    const SurfaceRow::Support& support = row.supports[s];
    const OrganResponseBody& body = bodies[support.body];
    if (body.model.free_index[support.node] < 0) continue;
    if (!body.isolated.known(support.node)) return false;
    any = any || support.weight != 0;
  }
  return any;
}

/// Opening of a row per force on a node [3], m/N.
Vector3d opening(const SurfaceRow& row, int body, int node, const OrganResponseBody& of) {
  Vector3d sum = Vector3d::Zero();
  for (int s = 0; s < row.support_count; ++s) {
    const SurfaceRow::Support& support = row.supports[s];
    if (support.body != body || !of.isolated.known(support.node)) continue;
    sum += support.weight * (of.isolated.block(node, support.node) * row.normal);
  }
  return sum;
}

/// n_i^T (motion of row i per force on row j) n_j, m/N.
double between(const SurfaceRow& row, const SurfaceRow& other, std::span<const OrganResponseBody> bodies) {
  double sum = 0;
  for (int a = 0; a < row.support_count; ++a) {
    const SurfaceRow::Support& at = row.supports[a];
    const IsolatedDofs& isolated = bodies[at.body].isolated;
    if (!isolated.known(at.node)) continue;
    for (int b = 0; b < other.support_count; ++b) {
      const SurfaceRow::Support& from = other.supports[b];
      if (from.body != at.body || !isolated.known(from.node)) continue;
      sum += at.weight * from.weight * row.normal.dot(isolated.block(at.node, from.node) * other.normal);
    }
  }
  return sum;
}

std::uint64_t id_of(const SurfaceRow& row) {
  return (static_cast<std::uint64_t>(row.pair + 1) << 40) + row.slot;
}

}  // namespace

OrganResponse::OrganResponse()
    : w_(Eigen::MatrixXd::Zero(kMaxOrganRows, kMaxOrganRows)),
      gap_(Eigen::VectorXd::Zero(kMaxOrganRows)),
      lambda_0_(gap_),
      lambda_(gap_),
      u_(gap_),
      d_(gap_),
      states_(kMaxOrganRows),
      diagonal_(kMaxOrganRows),
      softening_(kMaxOrganRows),
      zeros_(kMaxOrganRows, 0.0),
      unbounded_(kMaxOrganRows, std::numeric_limits<double>::infinity()),
      pivoting_(kMaxOrganRows) {}

void OrganResponse::choose(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies) {
  count_ = 0;
  chosen_.clear();
  for (std::vector<int>& nodes : nodes_) nodes.clear();
  std::vector<std::pair<double, int>> ranked;  // by what the needle does to the row, the most first
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!known(rows[i], bodies)) continue;
    double most = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const bool touches = std::any_of(rows[i].supports.begin(), rows[i].supports.begin() + rows[i].support_count,
                                       [&](const auto& support) { return support.body == static_cast<int>(b); });
      for (std::size_t n = 0; touches && n < bodies[b].patch_nodes.size(); ++n) {
        const int node = bodies[b].patch_nodes[n];
        if (!bodies[b].isolated.known(node)) continue;
        most = std::max(most, opening(rows[i], static_cast<int>(b), node, bodies[b]).squaredNorm());
      }
    }
    const double gap = rows[i].lambda > 0 ? 0 : std::max(0.0, rows[i].gap) / kNear;
    if (most > 0) ranked.emplace_back(-most / (1 + gap * gap), static_cast<int>(i));
  }
  if (ranked.size() > kMaxOrganRows) {
    std::nth_element(ranked.begin(), ranked.begin() + kMaxOrganRows, ranked.end());
    ranked.resize(kMaxOrganRows);
  }
  for (const auto& [rank, row] : ranked) chosen_.push_back(row);
  std::sort(chosen_.begin(), chosen_.end());
  count_ = static_cast<int>(chosen_.size());

  for (int i = 0; i < count_; ++i) {
    const SurfaceRow& row = rows[chosen_[i]];
    for (int j = 0; j <= i; ++j) w_(i, j) = w_(j, i) = between(row, rows[chosen_[j]], bodies);
    w_(i, i) += row.compliance;
    diagonal_[i] = w_(i, i);
    lambda_0_[i] = row.lambda;
    states_[i] = row.lambda > 0 ? RowState::sticking : RowState::lower;
    for (int s = 0; s < row.support_count; ++s) {
      std::vector<int>& nodes = nodes_[row.supports[s].body];
      const int node = row.supports[s].node;
      if (bodies[row.supports[s].body].isolated.known(node) &&
          std::find(nodes.begin(), nodes.end(), node) == nodes.end()) {
        nodes.push_back(node);
      }
    }
  }
  if (pivoting_.load(w_.topLeftCorner(count_, count_), diagonal_.data(), softening_.data()) < 0) count_ = 0;
}

void OrganResponse::open(std::span<const SurfaceRow> rows, std::span<const Eigen::Matrix3Xd> moved) {
  for (int i = 0; i < count_; ++i) {
    const SurfaceRow& row = rows[chosen_[i]];
    gap_[i] = row.gap + row.compliance * row.lambda;
    for (int s = 0; s < row.support_count; ++s) {
      const std::vector<int>& nodes = nodes_[row.supports[s].body];
      const auto at = std::find(nodes.begin(), nodes.end(), row.supports[s].node);
      if (at == nodes.end()) continue;
      gap_[i] += row.supports[s].weight * row.normal.dot(moved[row.supports[s].body].col(at - nodes.begin()));
    }
  }
  if (!gap_.head(count_).allFinite()) count_ = 0;
}

void OrganResponse::fill(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies,
                         OrganRows& out) const {
  out.count = count_;
  if (count_ == 0) return;
  out.gap.head(count_) = gap_.head(count_);
  out.lambda.head(count_) = lambda_0_.head(count_);
  out.w.topLeftCorner(count_, count_) = w_.topLeftCorner(count_, count_);
  for (int i = 0; i < count_; ++i) out.ids[i] = id_of(rows[chosen_[i]]);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (std::size_t n = 0; n < bodies[b].patch_nodes.size(); ++n) {
      const int node = bodies[b].patch_nodes[n];
      auto y = out.y[b].middleCols<3>(static_cast<Eigen::Index>(3 * n)).topRows(count_);
      if (!bodies[b].isolated.known(node)) {
        y.setZero();
        continue;
      }
      for (int i = 0; i < count_; ++i) {
        y.row(i) = opening(rows[chosen_[i]], static_cast<int>(b), node, bodies[b]).transpose();
      }
    }
  }
}

bool OrganResponse::respond(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies,
                            std::span<const Eigen::VectorXd* const> forces,
                            std::span<const std::vector<int>* const> loaded) {
  if (count_ == 0) return false;
  d_.head(count_) = gap_.head(count_);
  d_.head(count_).noalias() -= w_.topLeftCorner(count_, count_) * lambda_0_.head(count_);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (const int node : *loaded[b]) {
      if (!bodies[b].isolated.known(node)) continue;
      const Vector3d force = forces[b]->segment<3>(3 * bodies[b].model.free_index[node]);
      for (int i = 0; i < count_; ++i) {
        d_[i] += opening(rows[chosen_[i]], static_cast<int>(b), node, bodies[b]).dot(force);
      }
    }
  }
  return solve_unilateral(pivoting_, w_.topLeftCorner(count_, count_), d_, zeros_, unbounded_, states_.data(),
                          lambda_, u_) &&
         lambda_.head(count_).allFinite();
}

}  // namespace stylet::physics
