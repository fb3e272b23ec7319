#include "tools/bench/gauss_seidel.h"

#include <cmath>

namespace stylet::bench {

GaussSeidelResult gauss_seidel(const Eigen::MatrixXd& w, const Eigen::VectorXd& delta, double tolerance,
                               int most_sweeps, Eigen::VectorXd& lambda) {
  const double enough = tolerance * delta.lpNorm<1>();
  GaussSeidelResult result;
  while (result.sweeps < most_sweeps && !result.converged) {
    double removed = 0;
    for (Eigen::Index i = 0; i < lambda.size(); ++i) {
      const double violation = delta[i] + w.col(i).dot(lambda);  // W is symmetric: its columns are its rows
      lambda[i] -= violation / w(i, i);
      removed += std::abs(violation);
    }
    ++result.sweeps;
    result.converged = removed <= enough;
  }
  return result;
}

}  // namespace stylet::bench
