#include "physics/tissue/isolated_dofs.h"

#include <algorithm>
#include <utility>

namespace stylet::physics {
namespace {

constexpr int kNodesPerSolve = 16;  // 48 right-hand sides: BLAS 3 in the supernodes, bounded scratch

}  // namespace

IsolatedDofs::IsolatedDofs(int body_nodes, int capacity)
    : capacity_(capacity), slot_(static_cast<std::size_t>(body_nodes), -1), w_(3 * capacity, 3 * capacity) {
  known_.reserve(static_cast<std::size_t>(capacity));
}

void IsolatedDofs::clear() {
  for (const int node : known_) slot_[static_cast<std::size_t>(node)] = -1;
  known_.clear();
}

void IsolatedDofs::keep_only(std::span<const int> nodes) {
  std::vector<char> wanted(slot_.size(), 0);
  for (const int node : nodes) wanted[static_cast<std::size_t>(node)] = 1;
  std::vector<int> old_slots;
  std::vector<int> kept;
  for (std::size_t s = 0; s < known_.size(); ++s) {
    if (wanted[static_cast<std::size_t>(known_[s])] == 0) continue;
    old_slots.push_back(static_cast<int>(s));
    kept.push_back(known_[s]);
  }
  // Blocks only move towards the top left, in an order in which nothing is overwritten before it is read.
  for (std::size_t j = 0; j < kept.size(); ++j) {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const Eigen::Matrix3d block = w_.block<3, 3>(3 * old_slots[i], 3 * old_slots[j]);
      w_.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) = block;
    }
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    std::swap(columns_[i], columns_[static_cast<std::size_t>(old_slots[i])]);
  }
  clear();
  known_ = kept;
  for (std::size_t s = 0; s < known_.size(); ++s) slot_[static_cast<std::size_t>(known_[s])] = static_cast<int>(s);
}

int IsolatedDofs::isolate(std::span<const int> nodes, const TissueModel& model, const Factorisation& factor,
                          SolveWorkspace& workspace) {
  std::vector<int> fresh;
  for (const int node : nodes) {
    const auto n = static_cast<std::size_t>(node);
    if (slot_[n] < 0 && model.free_index[n] >= 0) fresh.push_back(node);
  }
  if (known_.size() + fresh.size() > static_cast<std::size_t>(capacity_)) keep_only(nodes);

  Eigen::MatrixXd& columns = workspace.columns;
  for (std::size_t begin = 0; begin < fresh.size(); begin += kNodesPerSolve) {
    const std::size_t count = std::min<std::size_t>(kNodesPerSolve, fresh.size() - begin);
    const auto width = static_cast<Eigen::Index>(3 * count);
    columns.setZero(factor.dof_count(), width);
    for (std::size_t k = 0; k < count; ++k) {
      const int dof = 3 * model.free_index[static_cast<std::size_t>(fresh[begin + k])];
      for (int c = 0; c < 3; ++c) columns(dof + c, static_cast<Eigen::Index>(3 * k) + c) = 1;
    }
    factor.solve(columns, columns, workspace);
    for (std::size_t k = 0; k < count; ++k) {
      const int node = fresh[begin + k];
      slot_[static_cast<std::size_t>(node)] = static_cast<int>(known_.size());
      known_.push_back(node);
      if (columns_.size() < known_.size()) columns_.emplace_back();
      columns_[known_.size() - 1] = columns.middleCols<3>(static_cast<Eigen::Index>(3 * k));
      const auto j = static_cast<Eigen::Index>(3 * (known_.size() - 1));
      for (std::size_t s = 0; s < known_.size(); ++s) {
        const int dof = 3 * model.free_index[static_cast<std::size_t>(known_[s])];
        const auto i = static_cast<Eigen::Index>(3 * s);
        Eigen::Matrix3d block = columns.block<3, 3>(dof, static_cast<Eigen::Index>(3 * k));
        if (i == j) block = 0.5 * (block + block.transpose()).eval();  // symmetric up to rounding: make it exactly so
        w_.block<3, 3>(i, j) = block;
        w_.block<3, 3>(j, i) = block.transpose();
      }
    }
  }
  return static_cast<int>(fresh.size());
}

bool IsolatedDofs::add_response(int node, const Eigen::Vector3d& force,
                                Eigen::Ref<Eigen::VectorXd> displacement) const {
  const int slot = slot_[static_cast<std::size_t>(node)];
  if (slot < 0) return false;
  const Eigen::MatrixX3d& columns = columns_[static_cast<std::size_t>(slot)];
  displacement += columns.col(0) * force[0] + columns.col(1) * force[1] + columns.col(2) * force[2];
  return true;
}

void IsolatedDofs::gather(std::span<const int> nodes, Eigen::Ref<Eigen::MatrixXd> w_bar) const {
  for (std::size_t b = 0; b < nodes.size(); ++b) {
    const int column = slot_[static_cast<std::size_t>(nodes[b])];
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const int row = slot_[static_cast<std::size_t>(nodes[a])];
      auto block = w_bar.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
      if (row < 0 || column < 0) {
        block.setZero();
      } else {
        block = w_.block<3, 3>(3 * row, 3 * column);
      }
    }
  }
}

}  // namespace stylet::physics
