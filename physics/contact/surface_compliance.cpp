#include "physics/contact/surface_compliance.h"

#include <algorithm>

namespace stylet::physics {
namespace {

constexpr std::size_t kNodesAPass = 32;  // 96 right-hand sides for one reading of L
constexpr std::size_t kSpareNodes = 64;  // gathered ones: so many may be in vain beside half of all
constexpr std::size_t kWorkers = 4;      // each with scratch of its own; enough that two threads end together

}  // namespace

SurfaceCompliance::SurfaceCompliance(const TissueModel& model, const Factorisation& at_rest,
                                     std::span<const int> boundary)
    : model_(model),
      factor_(at_rest),
      boundary_(boundary.begin(), boundary.end()),
      place_(model.mesh.nodes.size(), -1),
      columns_(boundary.size()),
      gathered_row_(boundary.size(), -1) {
  for (std::size_t i = 0; i < boundary_.size(); ++i) {
    place_[boundary_[i]] = static_cast<int>(i);
  }
}

int SurfaceCompliance::learn(std::span<const int> nodes, int limit, SolveWorkspace& workspace) {
  std::vector<int> fresh;
  for (const int node : nodes) {
    if (static_cast<int>(fresh.size()) == limit) break;
    if (!known(node) && std::find(fresh.begin(), fresh.end(), node) == fresh.end()) fresh.push_back(node);
  }
  if (!fresh.empty()) solve(fresh, workspace);
  return static_cast<int>(fresh.size());
}

void SurfaceCompliance::learn_all(std::span<const int> nodes, Companion* companion) {
  std::vector<int> fresh;
  for (const int node : nodes) {
    if (!known(node)) fresh.push_back(node);
  }
  std::sort(fresh.begin(), fresh.end());
  fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
  const std::size_t passes = (fresh.size() + kNodesAPass - 1) / kNodesAPass;
  const std::size_t workers = std::min<std::size_t>(passes, kWorkers);
  in_parts(companion, static_cast<int>(workers), [&](int part) {
    SolveWorkspace workspace;
    for (std::size_t p = static_cast<std::size_t>(part); p < passes; p += workers) {
      const std::size_t first = p * kNodesAPass;
      solve(std::span(fresh).subspan(first, std::min(kNodesAPass, fresh.size() - first)), workspace);
    }
  });
}

void SurfaceCompliance::solve(std::span<const int> fresh, SolveWorkspace& workspace) {
  Eigen::MatrixXd& unit = workspace.columns;
  unit.setZero(model_.dof_count(), static_cast<Eigen::Index>(3 * fresh.size()));
  for (std::size_t k = 0; k < fresh.size(); ++k) {
    const int dof = 3 * model_.free_index[fresh[k]];
    for (int c = 0; c < 3; ++c) unit(dof + c, static_cast<Eigen::Index>(3 * k) + c) = 1;
  }
  factor_.solve(unit, unit, workspace);
  for (std::size_t k = 0; k < fresh.size(); ++k) {
    Eigen::MatrixX3f& column = columns_[index(fresh[k])];
    column.setZero(static_cast<Eigen::Index>(3 * boundary_.size()), 3);
    for (std::size_t i = 0; i < boundary_.size(); ++i) {
      const int dof = 3 * model_.free_index[boundary_[i]];
      if (dof < 0) continue;
      column.middleRows<3>(static_cast<Eigen::Index>(3 * i)) =
          unit.block<3, 3>(dof, static_cast<Eigen::Index>(3 * k)).cast<float>();
    }
  }
}

Eigen::Matrix3d SurfaceCompliance::block(int a, int b) const {
  if (fixed(a) || fixed(b)) return Eigen::Matrix3d::Zero();
  // The column of the smaller index for both orders: exactly symmetric.
  if (a < b) {
    const Eigen::Matrix3d transposed =
        columns_[index(a)].middleRows<3>(static_cast<Eigen::Index>(3 * index(b))).cast<double>();
    return transposed.transpose();
  }
  return columns_[index(b)].middleRows<3>(static_cast<Eigen::Index>(3 * index(a))).cast<double>();
}

void SurfaceCompliance::gather(std::span<const int> touched, std::span<const int> loaded) {
  if (gathered_.size() > 3 * touched.size() / 2 + kSpareNodes) {  // most of them touch nothing any more
    for (const int node : gathered_) gathered_row_[index(node)] = -1;
    gathered_.clear();
  }
  for (const int node : touched) gather(node);
  for (const int node : loaded) gather(node);
}

void SurfaceCompliance::gather(int node) {
  if (gathered_row(node) >= 0 || fixed(node) || !known(node)) return;
  const Eigen::Index row = gathered_rows();
  gathered_row_[index(node)] = row;
  gathered_.push_back(node);
  if (side_by_side_.rows() < row + 3) {
    const Eigen::Index room = 2 * side_by_side_.rows() + 3 * static_cast<Eigen::Index>(kSpareNodes);
    side_by_side_.conservativeResize(room, room);
  }
  for (const int other : gathered_) {
    const Eigen::Matrix3f yields = block(node, other).cast<float>();
    side_by_side_.block<3, 3>(row, gathered_row(other)) = yields;
    side_by_side_.block<3, 3>(gathered_row(other), row) = yields.transpose();
  }
}

}  // namespace stylet::physics
