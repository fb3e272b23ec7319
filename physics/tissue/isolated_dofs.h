// W_bar: the compliance of the few nodes the needle touches (paper II-B, the IsoDOFs method), and the columns of A^-1
// it is cut from.
#pragma once

#include "physics/tissue/factorisation.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// W_bar = I_bar A^-1 I_bar^T for a changing set of nodes and a fixed factor   (physics/README.md eq. 8)
/// Entries stay valid while the factor does, so only nodes that were not isolated before cost a solve. A^-1 is
/// symmetric: the full column of a new DOF holds its coupling with all old ones. The columns are kept, so that the
/// whole body's response to forces on known nodes is a sum of columns and not a solve: for k nodes 3k numbers a DOF
/// are read instead of L twice. Memory: 24 bytes a DOF and known node.
class IsolatedDofs {
public:
  /// @param capacity  nodes that can be isolated at once
  IsolatedDofs(int body_nodes, int capacity);

  /// Forgets everything: the factor has changed.
  void clear();
  /// Makes the compliance of `nodes` available; returns how many nodes had to be computed.
  /// @param nodes  free or fixed nodes, distinct, at most `capacity`
  int isolate(std::span<const int> nodes, const TissueModel& model, const Factorisation& factor,
              SolveWorkspace& workspace);

  /// W_bar of `nodes`, in their order; zero rows and columns for fixed nodes.
  /// @param nodes       isolated before
  /// @param[out] w_bar  the leading [3n x 3n] block is written, exactly symmetric, m/N
  void gather(std::span<const int> nodes, Eigen::Ref<Eigen::MatrixXd> w_bar) const;

  /// Adds A^-1 of a force on one node to `displacement`   (physics/README.md eq. 6)
  /// @param force                 N
  /// @param[in,out] displacement  [free DOFs], m
  /// @return false, and nothing added, if the node's columns are not known
  bool add_response(int node, const Eigen::Vector3d& force, Eigen::Ref<Eigen::VectorXd> displacement) const;

  int known_nodes() const { return static_cast<int>(known_.size()); }

private:
  /// Forgets the nodes that are not in `nodes`.
  void keep_only(std::span<const int> nodes);

  int capacity_;
  std::vector<int> slot_;                  // [body nodes] place in known_, -1
  std::vector<int> known_;                 // nodes whose compliance is in w_
  Eigen::MatrixXd w_;                      // leading [3 known x 3 known] block
  std::vector<Eigen::MatrixX3d> columns_;  // [slots ever used] of A^-1 [free DOFs x 3]; storage outlives clear()
};

}  // namespace stylet::physics
