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

void OrganResponse::find_motions(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies,
                                 Companion* companion) {
  known_.clear();
  for (const SurfaceRow& row : rows) known_.push_back(known(row, bodies) ? 1 : 0);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const IsolatedDofs& isolated = bodies[b].isolated;
    places_[b].clear();
    for (const int node : bodies[b].patch_nodes) places_[b].push_back(isolated.place(node));
    const Eigen::Index dofs = 3 * isolated.known_nodes(), columns = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd& motions = motions_[b];
    if (motions.rows() < dofs || motions.cols() < columns)  // no fresh memory a step
      motions.resize(std::max(dofs, motions.rows()), std::max(columns, motions.cols()));
    pushes_.clear();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (known_[i] == 0) continue;
      for (int s = 0; s < rows[i].support_count; ++s) {
        const SurfaceRow::Support& support = rows[i].supports[s];
        if (support.body != static_cast<int>(b) || support.weight == 0 || !isolated.known(support.node)) continue;
        pushes_.push_back({static_cast<Eigen::Index>(i), support.node, support.weight * rows[i].normal});
      }
    }
    isolated.find_motions(pushes_, motions.topLeftCorner(dofs, columns), companion);
  }
}

void OrganResponse::choose(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies,
                           Companion* companion) {
  count_ = 0;
  chosen_.clear();
  find_motions(rows, bodies, companion);
  std::vector<std::pair<double, int>> ranked;  // by what the needle does to the row, the most first
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (known_[i] == 0) continue;
    double most = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const auto of_row = motions_[b].col(static_cast<Eigen::Index>(i));
      for (const int place : places_[b]) {
        if (place >= 0) most = std::max(most, of_row.segment<3>(3 * place).squaredNorm());
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
  find_nodes(rows, bodies);
  for (int i = 0; i < count_; ++i) {
    lambda_0_[i] = lambda_[i] = rows[chosen_[i]].lambda;
    states_[i] = lambda_0_[i] > 0 ? RowState::sticking : RowState::lower;
  }
  couple(rows, bodies);
  if (pivoting_.load(w_.topLeftCorner(count_, count_), diagonal_.data(), softening_.data()) < 0) count_ = 0;
}

void OrganResponse::find_nodes(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies) {
  std::array<std::vector<int>, kMaxBodies> index;  // of a known node in nodes_, by its place
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    nodes_[b].clear();
    index[b].assign(static_cast<std::size_t>(bodies[b].isolated.known_nodes()), -1);
  }
  for (int i = 0; i < count_; ++i) {
    const SurfaceRow& row = rows[chosen_[i]];
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& support = row.supports[s];
      const int place = bodies[support.body].isolated.place(support.node);
      at_[i][s] = -1;
      if (place < 0) continue;
      int& known = index[support.body][place];
      if (known < 0) {
        known = static_cast<int>(nodes_[support.body].size());
        nodes_[support.body].push_back(support.node);
      }
      at_[i][s] = known;
    }
  }
}

// W_ij = n_i^T (motion of row i per force on row j), plus the compliance of the row itself.
void OrganResponse::couple(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies) {
  struct Share {
    int body = 0;
    Eigen::Index dof = 0;  // of motions_
    Vector3d opens = Vector3d::Zero();
  };
  std::vector<Share> shares;
  std::vector<std::size_t> ends;  // of each row's
  for (int i = 0; i < count_; ++i) {
    const SurfaceRow& row = rows[chosen_[i]];
    for (int s = 0; s < row.support_count; ++s) {
      const SurfaceRow::Support& at = row.supports[s];
      if (at_[i][s] < 0 || at.weight == 0) continue;
      shares.push_back({.body = at.body,
                        .dof = 3 * Eigen::Index{bodies[at.body].isolated.place(at.node)},
                        .opens = at.weight * row.normal});
    }
    ends.push_back(shares.size());
  }
  for (int j = 0; j < count_; ++j) {
    std::size_t share = j == 0 ? 0 : ends[j - 1];
    for (int i = j; i < count_; ++i) {
      double sum = 0;
      for (; share < ends[i]; ++share) {
        const Share& of = shares[share];
        sum += of.opens.dot(motions_[of.body].col(chosen_[j]).segment<3>(of.dof));
      }
      w_(i, j) = w_(j, i) = sum;
    }
  }
  for (int i = 0; i < count_; ++i) {
    w_(i, i) += rows[chosen_[i]].compliance;
    diagonal_[i] = w_(i, i);
  }
}

void OrganResponse::open(std::span<const SurfaceRow> rows, std::span<const Eigen::Matrix3Xd> moved) {
  for (int i = 0; i < count_; ++i) {
    const SurfaceRow& row = rows[chosen_[i]];
    gap_[i] = row.gap + row.compliance * row.lambda;
    for (int s = 0; s < row.support_count; ++s) {
      if (at_[i][s] < 0) continue;
      gap_[i] += row.supports[s].weight * row.normal.dot(moved[row.supports[s].body].col(at_[i][s]));
    }
  }
  if (!gap_.head(count_).allFinite()) count_ = 0;
}

void OrganResponse::fill(std::span<const SurfaceRow> rows, OrganRows& out) const {
  out.count = count_;
  if (count_ == 0) return;
  out.gap.head(count_) = gap_.head(count_);
  out.lambda.head(count_) = lambda_0_.head(count_);
  out.w.topLeftCorner(count_, count_) = w_.topLeftCorner(count_, count_);
  for (int i = 0; i < count_; ++i) out.ids[i] = id_of(rows[chosen_[i]]);
  for (std::size_t b = 0; b < places_.size(); ++b) {
    for (std::size_t n = 0; n < places_[b].size(); ++n) {
      auto y = out.y[b].middleCols<3>(static_cast<Eigen::Index>(3 * n));
      if (places_[b][n] < 0) {
        y.topRows(count_).setZero();
        continue;
      }
      for (int i = 0; i < count_; ++i) {
        y.row(i) = motions_[b].col(chosen_[i]).segment<3>(3 * places_[b][n]).transpose();
      }
    }
  }
}

bool OrganResponse::respond(std::span<const OrganResponseBody> bodies, std::span<const Eigen::VectorXd* const> forces,
                            std::span<const std::vector<int>* const> loaded) {
  if (count_ == 0) return false;
  d_.head(count_) = gap_.head(count_);
  d_.head(count_).noalias() -= w_.topLeftCorner(count_, count_) * lambda_0_.head(count_);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    for (const int node : *loaded[b]) {
      const int place = bodies[b].isolated.place(node);
      if (place < 0) continue;
      // What a force on the row moves the node by is how a force on the node opens the row: W_bar is symmetric.
      const Vector3d force = forces[b]->segment<3>(3 * bodies[b].model.free_index[node]);
      for (int i = 0; i < count_; ++i) d_[i] += motions_[b].col(chosen_[i]).segment<3>(3 * place).dot(force);
    }
  }
  const bool found = solve_unilateral(pivoting_, w_.topLeftCorner(count_, count_), d_, zeros_, unbounded_,
                                      states_.data(), lambda_, u_) &&
                     lambda_.head(count_).allFinite();
  if (!found) lambda_.head(count_) = lambda_0_.head(count_);
  return found;
}

void OrganResponse::add_motion(int body, Eigen::Ref<Eigen::VectorXd> motion) const {
  for (int i = 0; i < count_; ++i) {
    motion += (lambda_[i] - lambda_0_[i]) * motions_[body].col(chosen_[i]).head(motion.size());
  }
}

}  // namespace stylet::physics
