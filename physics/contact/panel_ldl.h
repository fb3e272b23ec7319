// Dense symmetric elimination in place, eight columns at a time.
#pragma once

#include <Eigen/Core>

namespace stylet::physics {

/// Eliminates the leading rows A of a symmetric matrix by L D L^T and leaves the Schur complement S of the trailing
/// ones:
///
///   [A  B^T]   [L_A   ] [D   ] [L_A^T  L_B^T]
///   [B  C  ] = [L_B  I] [   S] [       I    ],   S = C - B A^-1 B^T
///
/// Rows are stored in panels of eight; both groups are padded to whole panels with rows that do nothing, so indices
/// run over 0..leading-1 and trailing_start()..trailing_start()+trailing-1, and vectors have size() entries.
/// @realtime nothing after the constructor allocates
class PanelLdl {
public:
  static constexpr int kPanel = 8;

  /// @param max_rows  leading plus trailing rows
  explicit PanelLdl(int max_rows);

  /// Sets the sizes and the padding. The caller then writes the lower triangle through column().
  void resize(int leading, int trailing);
  /// Column of the matrix, later of L (leading) or S (trailing); entries on and below the diagonal.
  double* column(int j) { return storage_.data() + static_cast<Eigen::Index>(j) * stride_; }
  const double* column(int j) const { return storage_.data() + static_cast<Eigen::Index>(j) * stride_; }
  int trailing_start() const { return padded_leading_; }
  int size() const { return padded_size_; }

  /// Eliminates. A row that depends on those before it (its pivot lost all its digits) is softened: its diagonal gets
  /// the compliance that makes the pivot kSoftening times the diagonal, the relative softness of physics/README.md
  /// eq. 18.
  /// @param[out] softening  added to the diagonal, 0 for a sound row [leading]
  /// @return rows softened, -1 if a pivot is not finite or a row has no diagonal
  /// O(m^3 / 6)
  int factorise(double* softening);

  /// x <- [y; x_trailing - L_B y], L_A y = x_leading.                                        [size()]
  void forward(double* x) const;
  /// Of [z; t]: z <- L_A^-T (z - L_B^T t).                                                   [size()]
  void backward(double* x) const;
  /// A x = b in place, D between the two passes.                                             [size()]
  void solve(double* x) const;
  double pivot(int j) const { return pivots_[j]; }

  /// Sensitivity of the leading solution: (A^-1 B^T)^T = L_B L_A^-1, one column a leading row.
  /// @param[out] y  [>= padded trailing rows x >= leading rows]
  void coupling(Eigen::MatrixXd& y);

  static constexpr double kSoftening = 1e-3;
  static constexpr double kLostDigits = 1e-12;  ///< pivot over diagonal below which a row counts as dependent

private:
  bool factorise_panel(int j, double* softening, int& softened);

  int stride_;
  int leading_ = 0;
  int padded_leading_ = 0;
  int padded_size_ = 0;
  Eigen::MatrixXd storage_;
  Eigen::VectorXd pivots_;
  Eigen::VectorXd diagonal_;  // before the elimination
  Eigen::VectorXd packed_;    // eight rows of L D or eight columns of L, contiguous
};

}  // namespace stylet::physics
