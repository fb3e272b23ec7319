// Symmetric positive definite block-tridiagonal systems with 6x6 blocks: the needle's A_n.
#pragma once

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// Block form of the Thomas algorithm as a Cholesky factorisation A = L L^T (physics/README.md eq. 13):
///   G_0 G_0^T = D_0,   U_i = G_i^-1 C_i,   G_{i+1} G_{i+1}^T = D_{i+1} - U_i^T U_i,
/// where L has the lower triangles G_i on its diagonal and U_i^T below. No inverse is ever formed, and because
/// B A^-1 B^T = (L^-1 B^T)^T (L^-1 B^T), a compliance needs only the forward half of the solve and comes out exactly
/// symmetric and positive semi-definite.
class BlockTridiagonal {
public:
  using Block = Eigen::Matrix<double, 6, 6>;

  /// @param block_count  number of 6x6 diagonal blocks; all memory is taken here
  explicit BlockTridiagonal(int block_count);

  int block_count() const { return static_cast<int>(diagonal_.size()); }

  /// Sets every block to zero.
  void set_zero();
  Block& diagonal(int i) { return diagonal_[i]; }  ///< D_i, symmetric
  Block& upper(int i) { return upper_[i]; }        ///< C_i: rows of block i, columns of i+1

  /// Factorises in place; false if the matrix is not positive definite (then it must be set anew).
  /// @realtime no allocation; O(block_count)
  bool factorise();

  /// x <- A^-1 x   [6 block_count].   @realtime
  void solve(Eigen::Ref<Eigen::VectorXd> x) const;

  /// Y <- L^-1 Y for many right-hand sides at once, one a column, a DOF's values contiguous.
  /// @param y        [6 block_count x columns], row-major, row stride >= columns
  /// @param columns  number of right-hand sides that are not all zero up to a block, the first ones, for every block;
  ///                 never less than for the block before                                            [block_count]
  /// @realtime no allocation; O(block_count columns)
  void forward_solve(double* y, std::span<const int> columns, int row_stride) const;

private:
  std::vector<Block> diagonal_;  // D_i, then G_i (lower triangle)
  std::vector<Block> upper_;     // C_i, then U_i
};

}  // namespace stylet::physics
