#include "physics/contact/constraint_solver.h"

#include <limits>

namespace stylet::physics {

ConstraintSolver::ConstraintSolver(int max_rows)
    : factor_(Eigen::MatrixXd::Zero(max_rows, max_rows)),
      pivots_(Eigen::VectorXd::Zero(max_rows)),
      scaled_(Eigen::VectorXd::Zero(max_rows)),
      solution_(Eigen::VectorXd::Zero(max_rows)) {}

bool ConstraintSolver::solve(Eigen::Ref<const Eigen::MatrixXd> w, double compliance,
                             Eigen::Ref<const Eigen::VectorXd> delta_free, Eigen::Ref<Eigen::VectorXd> lambda) {
  constexpr double kLostDigits = 1e-14;  // pivot over diagonal below which a row depends on those before it
  const Eigen::Index m = w.rows();
  smallest_pivot_ = std::numeric_limits<double>::infinity();

  for (Eigen::Index j = 0; j < m; ++j) {  // left-looking, a column at a time
    const Eigen::Index rest = m - j;
    auto column = factor_.col(j).segment(j, rest);
    column = w.col(j).tail(rest);
    column[0] += compliance;
    const double diagonal = column[0];
    for (Eigen::Index k = 0; k < j; ++k) scaled_[k] = factor_(j, k) * pivots_[k];
    if (j > 0) column.noalias() -= factor_.block(j, 0, rest, j) * scaled_.head(j);
    const double pivot = column[0];
    if (!(pivot >= smallest_pivot_)) smallest_pivot_ = pivot;
    if (!(pivot > kLostDigits * diagonal) || !(diagonal > 0)) return false;
    pivots_[j] = pivot;
    column /= pivot;
  }

  auto x = solution_.head(m);
  x = -delta_free;
  for (Eigen::Index j = 0; j + 1 < m; ++j) x.tail(m - j - 1) -= x[j] * factor_.col(j).segment(j + 1, m - j - 1);
  x.array() /= pivots_.head(m).array();
  for (Eigen::Index j = m - 1; j-- > 0;) x[j] -= factor_.col(j).segment(j + 1, m - j - 1).dot(x.tail(m - j - 1));
  lambda.head(m) = x;
  return true;
}

}  // namespace stylet::physics
