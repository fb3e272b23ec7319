// Gauss-Seidel for bilateral constraint rows, as interactive simulators commonly solve them.
#pragma once

#include <Eigen/Core>

namespace stylet::bench {

struct GaussSeidelResult {
  int sweeps = 0;
  bool converged = false;
};

/// W lambda = -delta. A sweep takes every row in turn; it ends when the violations the sweep removed, sum |w_ii
/// d lambda_i|, are below tolerance * sum |delta_i| (SOFA compares the same sum with an absolute length; relative to
/// the violation, the tolerance means the same in every unit).
/// @param w               symmetric positive definite [m x m], m/N
/// @param[in,out] lambda  first guess, then the solution [m], N
GaussSeidelResult gauss_seidel(const Eigen::MatrixXd& w, const Eigen::VectorXd& delta, double tolerance,
                               int most_sweeps, Eigen::VectorXd& lambda);

}  // namespace stylet::bench
