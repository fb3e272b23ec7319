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

  /// Puts S of some nodes side by side, as far as they are free and known: of what touches from step to step most
  /// stays the same.
  /// @param touched  distinct
  /// @param loaded   more of them, distinct
  void gather(std::span<const int> touched, std::span<const int> loaded);
  // Of the last gather():
  Eigen::Index gathered_rows() const { return static_cast<Eigen::Index>(3 * gathered_.size()); }
  /// First row of a boundary node among them; -1: it does not yield, or is not there.
  Eigen::Index gathered_row(int node) const { return gathered_row_[index(node)]; }
  /// Adds the motion of all of them for a force on the node with that first row.
  /// @param motion  [gathered_rows()] m
  void add_motion(Eigen::Index row, const Eigen::Vector3d& force, Eigen::VectorXf& motion) const {
    motion.noalias() += side_by_side_.block(0, row, motion.size(), 3) * force.cast<float>();
  }

private:
  void gather(int node);
  std::size_t index(int node) const { return static_cast<std::size_t>(place_[node]); }
  /// @param fresh  unknown, distinct
  void solve(std::span<const int> fresh, SolveWorkspace& workspace);
  bool fixed(int node) const { return model_.free_index[node] < 0; }

  const TissueModel& model_;
  Factorisation factor_;
  std::vector<int> boundary_;
  std::vector<int> place_;                  // [nodes] index in boundary_, -1
  std::vector<Eigen::MatrixX3f> columns_;   // [boundary] [3 boundary x 3], empty: not known
  std::vector<int> gathered_;               // nodes
  std::vector<Eigen::Index> gathered_row_;  // [boundary] -1
  Eigen::MatrixXf side_by_side_;            // [gathered_rows() x gathered_rows()], or larger
};

}  // namespace stylet::physics
