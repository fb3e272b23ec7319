#include "tools/reference/dense_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace stylet::reference {

using Eigen::MatrixXd;

MatrixXd product(const DenseInput& a, const DenseInput& b) {
  return a * b;
}

MatrixXd solve(const DenseInput& a, const DenseInput& b) {
  return Eigen::PartialPivLU<MatrixXd>(a).solve(b);
}

MatrixXd least_norm_solution(const DenseInput& a, const DenseInput& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).solve(b);
}

Eigen::MatrixX<long double> solve_extended(const Eigen::MatrixX<long double>& a,
                                           const Eigen::MatrixX<long double>& b) {
  return Eigen::FullPivLU<Eigen::MatrixX<long double>>(a).solve(b);
}

MatrixXd inverse(const DenseInput& a) {
  return Eigen::PartialPivLU<MatrixXd>(a).inverse();
}

bool is_positive_definite(const DenseInput& a) {
  return Eigen::LLT<MatrixXd>(a).info() == Eigen::Success;
}

Eigen::VectorXd symmetric_eigenvalues(const DenseInput& a) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues();
}

MatrixXd orthogonal_factor(const DenseInput& a) {
  return Eigen::HouseholderQR<MatrixXd>(a).householderQ();
}

}  // namespace stylet::reference
