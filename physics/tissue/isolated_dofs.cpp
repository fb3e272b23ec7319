#include "physics/tissue/isolated_dofs.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace stylet::physics {
namespace {

constexpr int kNodesPerPass = 16;         // 48 right-hand sides: matrix products in the supernodes, bounded scratch
constexpr int kRowsWorthSharing = 15000;  // of y; products of shorter ones are done before another thread wakes
constexpr std::size_t kParts = 8;         // enough that two threads end together

/// A node mistaken for another gives a W_bar that looks right and is not.
void require_coverage(std::span<const int> nodes, const TissueModel& model, const Factorisation& factor) {
  const std::span<const int> dofs = factor.trailing();
  bool covered = dofs.size() == 3 * nodes.size();
  for (std::size_t k = 0; covered && k < dofs.size(); ++k) {
    const int free = model.free_index[nodes[k / 3]];
    covered = free >= 0 && dofs[k] == 3 * free + static_cast<int>(k % 3);
  }
  if (covered) return;
  std::fprintf(stderr, "isolated DOFs: %zu nodes are not those of the factor's %zu trailing DOFs\n", nodes.size(),
               dofs.size());
  std::abort();
}

}  // namespace

IsolatedDofs::IsolatedDofs(int body_nodes, int capacity)
    : capacity_(capacity), slot_(static_cast<std::size_t>(body_nodes), -1), w_(3 * capacity, 3 * capacity) {
  known_.reserve(capacity);
}

void IsolatedDofs::clear() {
  for (const Known& known : known_) slot_[known.node] = -1;
  known_.clear();
}

void IsolatedDofs::reset(std::span<const int> trailing, const TissueModel& model, const Factorisation& factor) {
  require_coverage(trailing, model, factor);
  clear();
  const auto size = static_cast<Eigen::Index>(3 * trailing.size());
  factor.trailing_compliance(w_.topLeftCorner(size, size));
  for (const int node : trailing) {
    const auto place = static_cast<int>(known_.size());
    slot_[node] = place;
    known_.push_back({.node = node, .trailing = place, .forward = {}});
  }
}

void IsolatedDofs::keep_only(std::span<const int> nodes) {
  std::vector<char> wanted(slot_.size(), 0);
  for (const int node : nodes) wanted[node] = 1;
  std::vector<int> old_slots;
  for (std::size_t s = 0; s < known_.size(); ++s) {
    const auto node = static_cast<std::size_t>(known_[s].node);
    slot_[node] = -1;
    if (wanted[node] == 0) continue;
    const std::size_t kept = old_slots.size();
    slot_[node] = static_cast<int>(kept);
    old_slots.push_back(static_cast<int>(s));
    if (kept != s) known_[kept] = std::move(known_[s]);
  }
  known_.resize(old_slots.size());
  // Blocks only move towards the top left, in an order in which nothing is overwritten before it is read.
  for (std::size_t j = 0; j < old_slots.size(); ++j) {
    for (std::size_t i = 0; i < old_slots.size(); ++i) {
      const Eigen::Matrix3d moved = w_.block<3, 3>(3 * old_slots[i], 3 * old_slots[j]);
      w_.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) = moved;
    }
  }
}

int IsolatedDofs::isolate(std::span<const int> nodes, const TissueModel& model, const Factorisation& factor,
                          SolveWorkspace& workspace) {
  std::vector<int> fresh;
  for (const int node : nodes) {
    if (!known(node) && model.free_index[node] >= 0) fresh.push_back(node);
  }
  if (known_.size() + fresh.size() > static_cast<std::size_t>(capacity_)) keep_only(nodes);

  Eigen::MatrixXd& columns = workspace.columns;
  for (std::size_t begin = 0; begin < fresh.size(); begin += kNodesPerPass) {
    const std::size_t count = std::min<std::size_t>(kNodesPerPass, fresh.size() - begin);
    columns.setZero(factor.dof_count(), static_cast<Eigen::Index>(3 * count));
    for (std::size_t k = 0; k < count; ++k) {
      const int dof = 3 * model.free_index[fresh[begin + k]];
      for (int c = 0; c < 3; ++c) columns(dof + c, static_cast<Eigen::Index>(3 * k) + c) = 1;
    }
    factor.eliminate_columns(columns, workspace);
    const Eigen::MatrixXd on_trailing = factor.substitute_back_trailing(columns);
    for (std::size_t k = 0; k < count; ++k) {
      const auto c = static_cast<Eigen::Index>(3 * k);
      add(fresh[begin + k], columns.middleCols<3>(c), on_trailing.middleCols<3>(c), workspace.companion);
    }
  }
  return static_cast<int>(fresh.size());
}

void IsolatedDofs::add(int node, const Eigen::Ref<const Eigen::MatrixX3d>& forward,
                       const Eigen::Ref<const Eigen::MatrixX3d>& on_trailing, Companion* companion) {
  const auto j = static_cast<Eigen::Index>(3 * known_.size());
  slot_[node] = static_cast<int>(known_.size());
  known_.push_back({.node = node, .trailing = -1, .forward = forward});
  const auto fill = [&](std::size_t s) {
    const auto i = static_cast<Eigen::Index>(3 * s);
    const Known& other = known_[s];
    Eigen::Matrix3d compliance;
    if (other.trailing >= 0) {
      compliance = on_trailing.middleRows<3>(3 * other.trailing);
    } else {
      compliance.noalias() = other.forward.transpose() * forward;
    }
    // Symmetric up to rounding: make it exactly so.
    if (i == j) compliance = 0.5 * (compliance + compliance.transpose()).eval();
    w_.block<3, 3>(i, j) = compliance;
    w_.block<3, 3>(j, i) = compliance.transpose();
  };
  const std::size_t count = known_.size();
  const std::size_t parts = forward.rows() < kRowsWorthSharing ? 1 : std::min<std::size_t>(count, kParts);
  in_parts(companion, static_cast<int>(parts), [&](int part) {
    for (std::size_t s = static_cast<std::size_t>(part); s < count; s += parts) fill(s);
  });
}

void IsolatedDofs::gather(std::span<const int> nodes, Eigen::Ref<Eigen::MatrixXd> w_bar) const {
  for (std::size_t b = 0; b < nodes.size(); ++b) {
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      auto to = w_bar.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
      if (known(nodes[a]) && known(nodes[b])) {
        to = block(nodes[a], nodes[b]);
      } else {
        to.setZero();
      }
    }
  }
}

void IsolatedDofs::add_motion(std::span<const int> places, int node, const Eigen::Vector3d& force, double weight,
                              Eigen::Ref<Eigen::Matrix3Xd> motion) const {
  const auto columns = w_.middleCols<3>(3 * slot_[node]);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k] < 0) continue;
    motion.col(static_cast<Eigen::Index>(k)) += weight * (columns.middleRows<3>(3 * places[k]) * force);
  }
}

void IsolatedDofs::solution_at(std::span<const int> nodes, const Eigen::VectorXd& eliminated,
                               const Eigen::VectorXd& on_trailing, Eigen::Ref<Eigen::Matrix3Xd> x) const {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    auto to = x.col(static_cast<Eigen::Index>(k));
    if (!known(nodes[k])) {
      to.setZero();
      continue;
    }
    const Known& entry = known_[slot_[nodes[k]]];
    if (entry.trailing >= 0) {
      to = on_trailing.segment<3>(3 * entry.trailing);
    } else {
      to.noalias() = entry.forward.transpose() * eliminated;
    }
  }
}

}  // namespace stylet::physics
