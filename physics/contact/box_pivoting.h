// Bounded rows alone: which of them stick and which slip, by exact principal pivoting.
#pragma once

#include "physics/contact/panel_ldl.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::physics {

/// Where a bounded row is: sliding at its lower or upper bound, or sticking between them.
enum class RowState : std::int8_t { lower = -1, sticking = 0, upper = 1 };

/// Finds lambda [n] with u = S lambda + d, S symmetric positive definite, and for every row
///
///   sticking  lower <= lambda <= upper,  u = 0
///   upper     lambda = upper - k u,      u <= 0     (each bound with its own k)
///   lower     lambda = lower - k u,      u >= 0
///
/// that is y = lambda + k u in a box (dry friction) beside a dashpot k >= 0 (viscous friction). In y it is a linear
/// complementarity problem with the matrix (S^-1 + K)^-1, positive definite: one solution, and a finite method.
/// Wrong rows change state all at once (block pivoting, a handful of solves). When that stops removing wrong rows,
/// one row at a time, always the last wrong one (Murty's index rule). That ends: the first row moves only when the
/// others are right for its state, and their u_1 then grows with y_1, so it moves three times at most; the same holds
/// for the second row in between, and so on.
/// @realtime nothing after the constructor allocates
class BoxPivoting {
public:
  explicit BoxPivoting(int max_rows);

  /// Takes a problem's matrix. Rows that depend on others are softened: compliance is added to their diagonal in S.
  /// @param[in,out] s       [n x n] both triangles, m/N
  /// @param diagonal        of the rows before others were eliminated, the scale of their rounding errors [n], m/N
  /// @param[out] softening  what was added [n]
  /// @return rows softened, -1 if S is not finite or has an empty diagonal
  int load(Eigen::Ref<Eigen::MatrixXd> s, const double* diagonal, double* softening);

  /// S, d, the box of every row and what it yields by; the caller's memory.
  struct Problem {
    Eigen::Ref<const Eigen::MatrixXd> s;  ///< [n x n] as load() left it
    const double* d;                      ///< [n], m
    const double* lower;                  ///< [n] -inf allowed
    const double* upper;                  ///< [n] +inf allowed, >= lower
    const double* viscosity;              ///< [n] k at the lower bound, N/m
    const double* viscosity_upper;        ///< [n] k at the upper bound, N/m
    const double* yielding;               ///< [n] g: a row without slip yields u = -g lambda; 0 sticks, m/N
  };
  /// @param[in,out] states   any first guess, then the solution's                        [n]
  /// @param[out] lambda, u   of the last states tried                                     [n], N, m
  /// @param[in,out] pivots   solves so far; ends the search at most_pivots
  /// @return whether the states are right
  bool solve(const Problem& problem, RowState* states, Eigen::VectorXd& lambda, Eigen::VectorXd& u, int most_pivots,
             int& pivots);

private:
  void solve_states(const Problem& problem, const RowState* states, Eigen::VectorXd& lambda, Eigen::VectorXd& u);
  void factorise_free(const Problem& problem, const RowState* states);

  PanelLdl factor_;
  std::vector<int> free_;      // rows whose multiplier is unknown: sticking, or sliding with a dashpot
  std::vector<double> added_;  // g or 1/k on the diagonal of each row in the factor; -1: not in it
  std::vector<double> softening_;
  Eigen::VectorXd x_;
  std::vector<int> wrong_;
};

}  // namespace stylet::physics
