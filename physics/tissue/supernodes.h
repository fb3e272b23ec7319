// The two passes of a triangular solve over the supernodes of a CHOLMOD factor, in the precision of its values.
// Internal to the factorisation.
#pragma once

#include <cholmod.h>

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace stylet::physics {

/// A supernode of L: a dense trapezoid, columns contiguous in the order of elimination.
template <typename Scalar>
struct Supernode {
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Map<Eigen::Matrix<Scalar, Eigen::Dynamic, 1>>;
  using Panel = Eigen::Map<const Matrix, 0, Eigen::OuterStride<>>;

  /// @param values   of L, as CHOLMOD lays the supernodes out
  /// @param leading  columns from here on are left to someone else: their rows are then rows below
  Supernode(const cholmod_factor& factor, const Scalar* values, std::size_t s, int leading) {
    const auto* super = static_cast<const int*>(factor.super);
    const auto* row_start = static_cast<const int*>(factor.pi);
    const auto* value_start = static_cast<const int*>(factor.px);
    first = super[s];
    columns = std::min(super[s + 1], leading) - first;
    rows = row_start[s + 1] - row_start[s];
    row = static_cast<const int*>(factor.s) + row_start[s];
    value = values + value_start[s];
  }
  /// Columns from `column` on, from the diagonal down: the zeros above it are never read.
  Panel panel(int column, int width) const {
    return Panel(value + static_cast<std::ptrdiff_t>(column) * rows + column, rows - column, width,
                 Eigen::OuterStride<>(rows));
  }

  int first = 0;
  int columns = 0;           // 0 or less: all left to someone else
  int rows = 0;              // the first `columns` of them are the diagonal block's
  const int* row = nullptr;  // [rows] in the order of elimination, ascending
  const Scalar* value = nullptr;
};

inline constexpr int kPanel = 8;  // columns handled at once: as many streams as the prefetchers follow

/// y <- L^-1 y for one supernode's columns, and what they do to the rows below. Nothing is read of a supernode whose
/// entries of y are zero, so a pass costs what its right-hand side reaches in the elimination tree.
/// @param scratch  [rows]
template <typename Scalar>
void eliminate(const Supernode<Scalar>& node, Scalar* y, Scalar* scratch) {
  using Vector = typename Supernode<Scalar>::Vector;
  Vector mine(y + node.first, node.columns);
  if ((mine.array() == Scalar(0)).all()) return;
  Vector w(scratch, node.rows);
  w.head(node.columns) = mine;
  w.tail(node.rows - node.columns).setZero();
  for (int c = 0; c < node.columns; c += kPanel) {
    const int width = std::min(kPanel, node.columns - c);
    const auto l = node.panel(c, width);
    l.topRows(width).template triangularView<Eigen::Lower>().solveInPlace(w.segment(c, width));
    const int below = node.rows - c - width;
    w.tail(below).noalias() -= l.bottomRows(below) * w.segment(c, width);
  }
  mine = w.head(node.columns);
  for (int i = node.columns; i < node.rows; ++i) y[node.row[i]] += w[i];
}

/// y <- L^-T y for one supernode's columns, from the rows below.
template <typename Scalar>
void substitute_back(const Supernode<Scalar>& node, Scalar* y, Scalar* scratch) {
  using Vector = typename Supernode<Scalar>::Vector;
  Vector w(scratch, node.rows);
  for (int i = 0; i < node.rows; ++i) w[i] = y[node.row[i]];
  for (int c = (node.columns - 1) / kPanel * kPanel; c >= 0; c -= kPanel) {
    const int width = std::min(kPanel, node.columns - c);
    const auto l = node.panel(c, width);
    const int below = node.rows - c - width;
    w.segment(c, width).noalias() -= l.bottomRows(below).transpose() * w.tail(below);
    l.topRows(width).template triangularView<Eigen::Lower>().transpose().solveInPlace(w.segment(c, width));
  }
  Vector(y + node.first, node.columns) = w.head(node.columns);
}

/// eliminate() for all columns of `y` [DOFs x columns] at once: L is read once for all of them. The bits of a column
/// do not depend on the others.
/// @param scratch  grows
void eliminate_columns(const Supernode<double>& node, Eigen::Ref<Eigen::MatrixXd> y, std::vector<double>& scratch);

}  // namespace stylet::physics
