// Dense direct solve of the bilateral contact rows.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace stylet::physics {

/// (W + c I) lambda = -delta_free by L D L^T   (physics/README.md eq. 18). Exact in one pass, where Gauss-Seidel
/// needs thousands of sweeps on these matrices.
class ConstraintSolver {
public:
  /// @param max_rows  capacity; all memory is taken here
  explicit ConstraintSolver(int max_rows);

  /// @param w           Delassus operator, the lower triangle is read [m x m], m/N
  /// @param compliance  c: softness of every row, m/N; 0 is exact
  /// @param delta_free  [m], m
  /// @param[out] lambda [m], N; untouched on failure
  /// @return false if a pivot is not positive or lost all its digits (dependent rows without compliance, non-finite
  /// W)
  /// @realtime no allocation; O(m^3 / 6)
  bool solve(Eigen::Ref<const Eigen::MatrixXd> w, double compliance, Eigen::Ref<const Eigen::VectorXd> delta_free,
             Eigen::Ref<Eigen::VectorXd> lambda);

  /// Smallest pivot of the last solve(), m/N: by how much the row that depends most on the rows before it still
  /// yields when those are held. Infinite for no rows; of a failed solve that of the row where it stopped.
  /// Of W + c I none is below c, so one near c tells that the softness alone decides the multiplier.
  double smallest_pivot() const { return smallest_pivot_; }

private:
  Eigen::MatrixXd factor_;  // unit lower triangle L
  Eigen::VectorXd pivots_;  // D
  Eigen::VectorXd scaled_;  // a row of L times D
  Eigen::VectorXd solution_;
  double smallest_pivot_ = 0;
};

}  // namespace stylet::physics
