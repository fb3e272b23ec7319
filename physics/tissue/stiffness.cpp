#include "physics/tissue/stiffness.h"

#include <algorithm>
#include <utility>

namespace stylet::physics {
namespace {

constexpr std::array<std::pair<int, int>, 10> kPairs{
    {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}, {3, 0}, {3, 1}, {3, 2}, {3, 3}}};

}  // namespace

StiffnessPattern::StiffnessPattern(const TissueModel& model) {
  // Free neighbours with a larger index, per free node: the blocks below the diagonal of its three columns.
  std::vector<std::vector<int>> below(static_cast<std::size_t>(model.free_node_count));
  for (const auto& tet : model.mesh.tets) {
    for (const int n : tet) {
      for (const int m : tet) {
        const int i = model.free_index[n];
        const int j = model.free_index[m];
        if (j >= 0 && i > j) below[j].push_back(i);
      }
    }
  }
  column_start_.push_back(0);
  for (std::size_t j = 0; j < below.size(); ++j) {
    auto& list = below[j];
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) rows_.push_back(static_cast<int>(3 * j) + r);
      for (const int i : list) {
        for (int r = 0; r < 3; ++r) rows_.push_back(3 * i + r);
      }
      column_start_.push_back(static_cast<int>(rows_.size()));
    }
  }

  scatter_.resize(model.mesh.tets.size());
  for (std::size_t t = 0; t < model.mesh.tets.size(); ++t) {
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const auto free = [&](int a) { return model.free_index[model.mesh.tets[t][a]]; };
      BlockAddress& address = scatter_[t][k];
      address.row = kPairs[k].first;
      address.column = kPairs[k].second;
      if (free(address.row) < free(address.column)) std::swap(address.row, address.column);
      const int i = free(address.row);
      const int j = free(address.column);
      if (i < 0 || j < 0) continue;
      const auto& list = below[j];
      const auto rank = static_cast<int>(std::lower_bound(list.begin(), list.end(), i) - list.begin());
      for (int c = 0; c < 3; ++c) {
        const int start = column_start_[3 * j + c];
        // Diagonal block: its first entry is (c, c). Others come after the 3 - c entries of the diagonal block.
        address.start[c] = i == j ? start - c : start + (3 - c) + 3 * rank;
      }
    }
  }
}

void StiffnessPattern::assemble(const TissueModel& model, std::span<const Eigen::Quaterniond> rotations, double scale,
                                std::span<double> values, std::span<const SqueezedTet> squeezed) const {
  std::fill(values.begin(), values.end(), 0.0);
  for (std::size_t t = 0; t < scatter_.size(); ++t) {
    const TetRest& rest = model.tets[t];
    // K_ab = V (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I) with rotated gradients g = R grad N: R K0 R^T
    // without ever forming K0.
    const Eigen::Matrix<double, 3, 4> g = rotations[t].toRotationMatrix() * rest.gradients;
    const double lambda = scale * rest.volume * rest.lambda;
    const double mu = scale * rest.volume * rest.mu;
    for (const BlockAddress& address : scatter_[t]) {
      if (address.start[0] < 0) continue;
      const Eigen::Vector3d a = g.col(address.row);
      const Eigen::Vector3d b = g.col(address.column);
      const double diagonal = mu * a.dot(b);
      const bool below_diagonal = address.row != address.column;
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = below_diagonal ? 0 : c; r < 3; ++r) column[r] += lambda * a[r] * b[c] + mu * b[r] * a[c];
        column[c] += diagonal;
      }
    }
  }
  for (const SqueezedTet& tet : squeezed) {
    // V psi'' (dJ/dp)(dJ/dp)^T: positive semidefinite, of rank one.
    const TetRest& rest = model.tets[tet.tet];
    const Eigen::Matrix<double, 3, 4> g = tet.cofactor * rest.gradients;
    for (const BlockAddress& address : scatter_[tet.tet]) {
      if (address.start[0] < 0) continue;
      const Eigen::Vector3d a = scale * rest.volume * tet.curvature * g.col(address.row);
      for (int c = 0; c < 3; ++c) {
        double* const column = values.data() + address.start[c];
        for (int r = address.row != address.column ? 0 : c; r < 3; ++r) column[r] += a[r] * g(c, address.column);
      }
    }
  }
}

}  // namespace stylet::physics
