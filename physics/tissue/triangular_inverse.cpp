#include "physics/tissue/triangular_inverse.h"

#include <algorithm>

namespace stylet::physics {
namespace {

constexpr Eigen::Index kBlock = 48;  // below, a column-wise solve is as fast as products

}  // namespace

void invert_lower_triangle(Eigen::Ref<Eigen::MatrixXd> l) {
  const Eigen::Index n = l.rows();
  if (n <= kBlock) {
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n);
    l.triangularView<Eigen::Lower>().solveInPlace(inverse);
    l = inverse;
    return;
  }
  // [A 0; B C]^-1 = [A^-1 0; -C^-1 B A^-1  C^-1]
  const Eigen::Index half = n / 2;
  const Eigen::Index rest = n - half;
  invert_lower_triangle(l.topLeftCorner(half, half));
  invert_lower_triangle(l.bottomRightCorner(rest, rest));
  const Eigen::MatrixXd right =
      l.bottomLeftCorner(rest, half) * l.topLeftCorner(half, half).triangularView<Eigen::Lower>();
  l.bottomLeftCorner(rest, half).noalias() =
      -(l.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>() * right);
}

void multiply_by_own_transpose(Eigen::Ref<Eigen::MatrixXd> x) {
  const Eigen::Index n = x.rows();
  // Columns from i on of X^T X need only rows and columns from i on of X: going right, nothing is overwritten that is
  // still needed.
  for (Eigen::Index i = 0; i < n; i += kBlock) {
    const Eigen::Index width = std::min(kBlock, n - i);
    const Eigen::Index below = n - i;
    const Eigen::MatrixXd mine = x.block(i, i, below, width);
    const Eigen::MatrixXd product = x.block(i, i, below, below).triangularView<Eigen::Lower>().transpose() * mine;
    x.block(i, i, below, width) = product;
  }
  x.triangularView<Eigen::StrictlyUpper>() = x.transpose();
}

}  // namespace stylet::physics
