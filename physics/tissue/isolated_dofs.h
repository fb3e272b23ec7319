// W_bar: the compliance of the few nodes the needle touches (paper II-B, the IsoDOFs method).
#pragma once

#include "physics/tissue/companion.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// W_bar = I_bar A^-1 I_bar^T for a changing set of nodes and a fixed factor   (physics/README.md eq. 8)
/// The trailing nodes of the factor come for the inverse of a small block (reset()). Any other node costs the first
/// half of a solve for its three DOFs, y = L^-1 P e, once while the factor lasts: A^-1[a, b] = y_a . y_b, and with a
/// trailing node the solution on S is enough. Memory: 24 bytes a DOF for each of those other nodes.
class IsolatedDofs {
public:
  /// @param capacity  nodes that can be isolated at once
  IsolatedDofs(int body_nodes, int capacity);

  /// Makes the scratch of isolate() beforehand: a first needle in a large body would wait for it.
  static void make_scratch(int dofs, SolveWorkspace& workspace);
  /// Forgets everything: the factor has changed.
  void clear();
  /// Forgets everything but knows the trailing nodes of the new factor.
  /// @param trailing  free nodes whose DOFs, three a node, are `factor.trailing()`; at most `capacity`. Aborts
  ///                  otherwise: W_bar would be that of other nodes
  void reset(std::span<const int> trailing, const TissueModel& model, const Factorisation& factor);
  /// Makes the compliance of `nodes` available; returns how many nodes had to be computed.
  /// @param nodes  free or fixed nodes, distinct, at most `capacity`
  int isolate(std::span<const int> nodes, const TissueModel& model, const Factorisation& factor,
              SolveWorkspace& workspace);

  /// W_bar of `nodes`, in their order; zero rows and columns for fixed nodes.
  /// @param nodes       isolated before
  /// @param[out] w_bar  the leading [3n x 3n] block is written, exactly symmetric, m/N
  void gather(std::span<const int> nodes, Eigen::Ref<Eigen::MatrixXd> w_bar) const;

  bool known(int node) const { return slot_[node] >= 0; }
  int known_nodes() const { return static_cast<int>(known_.size()); }
  /// W_bar[row, column] of two known nodes, m/N.
  auto block(int row, int column) const { return w_.block<3, 3>(3 * slot_[row], 3 * slot_[column]); }
  /// Whether it is one of the factor's trailing nodes. The first places are theirs, in their order, if all are known.
  bool trailing(int node) const { return known(node) && known_[slot_[node]].trailing == slot_[node]; }
  /// Where a node is among the known ones, -1: not known. Until the next isolate() or reset().
  int place(int node) const { return slot_[node]; }
  /// A force on a known node, N, and the column of the motions that it is a part of.
  struct Push {
    Eigen::Index column = 0;
    int node = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
  };
  /// motions[:, column] = sum of W_bar[:, node] * force over its pushes, of all that are known, by place().
  /// @param pushes        ascending by column
  /// @param[out] motions  [3 known nodes x columns], m; zero without a push
  /// @param companion     takes a part of the rows; the bits do not know of it
  void find_motions(std::span<const Push> pushes, Eigen::Ref<Eigen::MatrixXd> motions,
                    Companion* companion = nullptr) const;
  /// x = A^-1 b at some nodes, from y = L^-1 P b: what the second half of the solve would find there.
  /// @param nodes        isolated before
  /// @param eliminated   y of Factorisation::eliminate() [free DOFs]
  /// @param on_trailing  of that, Factorisation::substitute_back_trailing()
  /// @param[out] x       [3 x nodes], zero at fixed nodes
  void solution_at(std::span<const int> nodes, const Eigen::VectorXd& eliminated, const Eigen::VectorXd& on_trailing,
                   Eigen::Ref<Eigen::Matrix3Xd> x) const;

private:
  struct Run {
    Rows rows;            // of y
    Eigen::Index at = 0;  // of the first of them in `forward`
  };
  struct Known {
    int node = 0;
    int trailing = -1;         // its place in S, counted in nodes
    std::vector<Run> runs;     // rows of y = L^-1 P e; none for trailing nodes
    Eigen::MatrixX3d forward;  // [rows of the runs x 3]
  };
  /// Keeps y, of a large body without its zeros: what a node reaches in the elimination tree is a small share of it.
  static void keep(const Eigen::Ref<const Eigen::MatrixX3d>& y, std::span<const Rows> reached, Known& known);
  /// y_a^T y_b
  static Eigen::Matrix3d product(const Known& a, const Known& b);
  void make_room(std::size_t nodes);
  /// Forgets the nodes that are not in `nodes`.
  void keep_only(std::span<const int> nodes);
  /// @param reached      rows of `forward` that may be other than zero
  /// @param on_trailing  A^-1 e on S [S x 3]
  void add(int node, const Eigen::Ref<const Eigen::MatrixX3d>& forward, std::span<const Rows> reached,
           const Eigen::Ref<const Eigen::MatrixX3d>& on_trailing, Companion* companion);

  int capacity_;
  std::vector<int> slot_;     // [body nodes] place in known_, -1
  std::vector<Known> known_;  // nodes whose compliance is in w_
  Eigen::MatrixXd w_;         // leading [3 known x 3 known] block; there is more, and more rows than columns
};

}  // namespace stylet::physics
