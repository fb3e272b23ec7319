// Dense linear algebra of the oracles, compiled once: Eigen's decompositions and products of dynamic size cost every
// file that uses them tens of seconds of compiler.
#pragma once

#include <Eigen/Core>

namespace stylet::reference {

using DenseInput = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// A B. [m x k] [k x n] -> [m x n]
Eigen::MatrixXd product(const DenseInput& a, const DenseInput& b);

/// A^-1 B by LU with partial pivoting. A: [n x n], regular; B: [n x k].
Eigen::MatrixXd solve(const DenseInput& a, const DenseInput& b);

/// x of least norm among those with least |A x - b|. A: [m x n], of any rank; b: [m x k].
Eigen::MatrixXd least_norm_solution(const DenseInput& a, const DenseInput& b);

/// solve() in long double, with full pivoting: for saddle points that mix units.
Eigen::MatrixX<long double> solve_extended(const Eigen::MatrixX<long double>& a,
                                           const Eigen::MatrixX<long double>& b);

/// A^-1 of a regular [n x n].
Eigen::MatrixXd inverse(const DenseInput& a);

/// Whether Cholesky's method finds a symmetric A positive definite; reads the lower triangle.
bool is_positive_definite(const DenseInput& a);

/// Ascending; of a symmetric [n x n], of which the lower triangle is read.
Eigen::VectorXd symmetric_eigenvalues(const DenseInput& a);

/// Q of A = Q R. [n x n]
Eigen::MatrixXd orthogonal_factor(const DenseInput& a);

}  // namespace stylet::reference
