#include "physics/tissue/isolated_dofs.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace stylet::physics {
namespace {

constexpr int kNodesPerPass = 16;        // 48 right-hand sides: matrix products in the supernodes, bounded scratch
constexpr int kLargeBody = 15000;        // rows of y: products of shorter ones are done before another thread wakes
constexpr int kRowsOfMotion = 32;        // summed at once
constexpr std::size_t kSpareNodes = 64;  // W_bar of few nodes lies close together
constexpr Eigen::Index kBlock = 32;      // rows that are left out together where they are zero
constexpr std::size_t kParts = 8;        // enough that two threads end together

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
    : capacity_(capacity), slot_(static_cast<std::size_t>(body_nodes), -1) {
  known_.reserve(capacity);
}

void IsolatedDofs::make_scratch(int dofs, SolveWorkspace& workspace) {
  const std::size_t size = std::size_t{3 * kNodesPerPass} * static_cast<std::size_t>(dofs);
  if (workspace.zeros.size() < size) workspace.zeros.resize(size, 0.0);
}

void IsolatedDofs::make_room(std::size_t nodes) {
  const std::size_t rounded = (nodes + kSpareNodes - 1) / kSpareNodes * kSpareNodes;
  const auto size = static_cast<Eigen::Index>(3 * std::min(rounded, static_cast<std::size_t>(capacity_)));
  if (w_.cols() < size) w_.conservativeResizeLike(Eigen::MatrixXd::Zero(size + kRowsOfMotion, size));
}

void IsolatedDofs::clear() {
  for (const Known& known : known_) slot_[known.node] = -1;
  known_.clear();
}

void IsolatedDofs::reset(std::span<const int> trailing, const TissueModel& model, const Factorisation& factor) {
  require_coverage(trailing, model, factor);
  clear();
  make_room(trailing.size() + kSpareNodes);
  const auto size = static_cast<Eigen::Index>(3 * trailing.size());
  factor.trailing_compliance(w_.topLeftCorner(size, size));
  for (const int node : trailing) {
    const auto place = static_cast<int>(known_.size());
    slot_[node] = place;
    known_.push_back({.node = node, .trailing = place, .runs = {}, .forward = {}});
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
  make_room(known_.size() + fresh.size());

  for (std::size_t begin = 0; begin < fresh.size(); begin += kNodesPerPass) {
    const std::size_t count = std::min<std::size_t>(kNodesPerPass, fresh.size() - begin);
    std::vector<int> dofs;
    for (std::size_t k = 0; k < 3 * count; ++k) {
      dofs.push_back(3 * model.free_index[fresh[begin + k / 3]] + static_cast<int>(k % 3));
    }
    make_scratch(factor.dof_count(), workspace);
    Eigen::Map<Eigen::MatrixXd> columns(workspace.zeros.data(), factor.dof_count(),
                                        static_cast<Eigen::Index>(dofs.size()));
    const std::vector<Rows> reached = factor.eliminate_units(dofs, columns, workspace);
    const Eigen::MatrixXd on_trailing = factor.substitute_back_trailing(columns);
    for (std::size_t k = 0; k < count; ++k) {
      const auto c = static_cast<Eigen::Index>(3 * k);
      add(fresh[begin + k], columns.middleCols<3>(c), reached, on_trailing.middleCols<3>(c), workspace.companion);
    }
    for (const Rows& rows : reached) columns.middleRows(rows.first, rows.count).setZero();
  }
  return static_cast<int>(fresh.size());
}

void IsolatedDofs::keep(const Eigen::Ref<const Eigen::MatrixX3d>& y, std::span<const Rows> reached, Known& known) {
  if (y.rows() < kLargeBody) {
    known.runs = {{.rows = {.first = 0, .count = y.rows()}, .at = 0}};
    known.forward = y;
    return;
  }
  Eigen::Index kept = 0;
  for (const Rows& rows : reached) {
    for (Eigen::Index row = rows.first; row < rows.end(); row += kBlock) {
      const Eigen::Index count = std::min(kBlock, rows.end() - row);
      if ((y.middleRows(row, count).array() == 0).all()) continue;
      if (!known.runs.empty() && known.runs.back().rows.end() == row) {
        known.runs.back().rows.count += count;
      } else {
        known.runs.push_back({.rows = {.first = row, .count = count}, .at = kept});
      }
      kept += count;
    }
  }
  known.forward.resize(kept, 3);
  for (const Run& run : known.runs) {
    known.forward.middleRows(run.at, run.rows.count) = y.middleRows(run.rows.first, run.rows.count);
  }
}

Eigen::Matrix3d IsolatedDofs::product(const Known& a, const Known& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0, j = 0; i < a.runs.size() && j < b.runs.size();) {
    const Run& p = a.runs[i];
    const Run& q = b.runs[j];
    const Eigen::Index begin = std::max(p.rows.first, q.rows.first);
    const Eigen::Index count = std::min(p.rows.end(), q.rows.end()) - begin;
    if (count > 0) {
      sum.noalias() += a.forward.middleRows(p.at + begin - p.rows.first, count).transpose() *
                       b.forward.middleRows(q.at + begin - q.rows.first, count);
    }
    (p.rows.end() < q.rows.end() ? i : j) += 1;
  }
  return sum;
}

void IsolatedDofs::add(int node, const Eigen::Ref<const Eigen::MatrixX3d>& forward, std::span<const Rows> reached,
                       const Eigen::Ref<const Eigen::MatrixX3d>& on_trailing, Companion* companion) {
  const auto j = static_cast<Eigen::Index>(3 * known_.size());
  slot_[node] = static_cast<int>(known_.size());
  keep(forward, reached, known_.emplace_back(Known{.node = node, .trailing = -1, .runs = {}, .forward = {}}));
  const auto fill = [&](std::size_t s) {
    const auto i = static_cast<Eigen::Index>(3 * s);
    const Known& other = known_[s];
    Eigen::Matrix3d compliance;
    if (other.trailing >= 0) {
      compliance = on_trailing.middleRows<3>(3 * other.trailing);
    } else {
      compliance = product(other, known_.back());
    }
    // Symmetric up to rounding: make it exactly so.
    if (i == j) compliance = 0.5 * (compliance + compliance.transpose()).eval();
    w_.block<3, 3>(i, j) = compliance;
    w_.block<3, 3>(j, i) = compliance.transpose();
  };
  const std::size_t count = known_.size();
  const std::size_t parts = forward.rows() < kLargeBody ? 1 : std::min<std::size_t>(count, kParts);
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

void IsolatedDofs::find_motions(std::span<const Push> pushes, Eigen::Ref<Eigen::MatrixXd> motions,
                                Companion* companion) const {
  // A few rows at a time: they stay in registers, and what several pushes read of W_bar in the first cache.
  using Some = Eigen::Array<double, kRowsOfMotion, 1>;
  const Eigen::Index blocks = (motions.rows() + kRowsOfMotion - 1) / kRowsOfMotion;
  const auto find_block = [&](Eigen::Index block) {  // W_bar has as many rows to spare
    const Eigen::Index row = block * kRowsOfMotion;
    const Eigen::Index rows = std::min<Eigen::Index>(kRowsOfMotion, motions.rows() - row);
    std::size_t next = 0;
    for (Eigen::Index column = 0; column < motions.cols(); ++column) {
      Some sum = Some::Zero();
      for (; next < pushes.size() && pushes[next].column == column; ++next) {
        const Push& push = pushes[next];
        const auto from = w_.block<kRowsOfMotion, 3>(row, 3 * slot_[push.node]).array();
        sum += push.force.x() * from.col(0) + push.force.y() * from.col(1) + push.force.z() * from.col(2);
      }
      if (rows == kRowsOfMotion) {
        motions.col(column).segment<kRowsOfMotion>(row) = sum.matrix();
      } else {
        motions.col(column).segment(row, rows) = sum.head(rows).matrix();
      }
    }
  };
  in_parts(companion, kSharedParts, [&](int part) {
    const auto [begin, end] = part_of(static_cast<std::size_t>(blocks), part);
    for (std::size_t block = begin; block < end; ++block) find_block(static_cast<Eigen::Index>(block));
  });
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
      to.setZero();
      for (const Run& run : entry.runs) {
        to.noalias() += entry.forward.middleRows(run.at, run.rows.count).transpose() *
                        eliminated.segment(run.rows.first, run.rows.count);
      }
    }
  }
}

}  // namespace stylet::physics
