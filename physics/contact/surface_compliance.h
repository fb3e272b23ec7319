// How a body's boundary yields: blocks of A^-1 at rest between boundary nodes, computed when first asked for and
// kept.
#pragma once

#include "physics/tissue/companion.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// S = I_b A_0^-1 I_b^T over the boundary nodes b of a body, A_0 its stiffness at rest. Contact needs S only to
/// choose the length of its steps (organ_contact.h), so it stays valid when the body deforms, and single precision
/// will do. Memory: 36 bytes a known node and boundary node, and a copy of the factor.
class SurfaceCompliance {
public:
  /// @param at_rest   factor of A_0; copied. `model` must outlive this.
  /// @param boundary  nodes, any order
  SurfaceCompliance(const TissueModel& model, const Factorisation& at_rest, std::span<const int> boundary);

  bool known(int node) const { return columns_[index(node)].rows() > 0 || fixed(node); }
  /// Computes up to `limit` of the unknown nodes, in their order; returns how many. Three solves a node.
  int learn(std::span<const int> nodes, int limit, SolveWorkspace& workspace);
  /// Computes all that are unknown.
  /// @param companion  takes a part of them, or null
  void learn_all(std::span<const int> nodes, Companion* companion);
  /// Motion of node a for a force on node b, m/N; both are known. Zero for fixed nodes. block(a, b) = block(b, a)^T.
  Eigen::Matrix3d block(int a, int b) const;

private:
  std::size_t index(int node) const { return static_cast<std::size_t>(place_[node]); }
  /// @param fresh  unknown, distinct
  void solve(std::span<const int> fresh, SolveWorkspace& workspace);
  bool fixed(int node) const { return model_.free_index[node] < 0; }

  const TissueModel& model_;
  Factorisation factor_;
  std::vector<int> boundary_;
  std::vector<int> place_;                 // [nodes] index in boundary_, -1
  std::vector<Eigen::MatrixX3f> columns_;  // [boundary] [3 boundary x 3], empty: not known
};

}  // namespace stylet::physics
