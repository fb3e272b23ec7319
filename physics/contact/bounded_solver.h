// One exact solve of forces of different nature: bilateral rows beside bounded ones (friction, cutting, unilateral).
#pragma once

#include "physics/contact/box_pivoting.h"
#include "physics/contact/panel_ldl.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace stylet::physics {

/// A row of the contact system, with the relative motion u = (W + C) lambda + delta along it during the step. With
/// P = mu |(lambda of the normal rows)|:
///
///   bilateral   u = 0
///   sticking    lower - P <= lambda <= upper + P,  u = 0
///   sliding     lambda = upper + P - k u where u <= 0,  lambda = lower - P - k u where u >= 0
///
/// Two rows of a disc, across each other, hold |(lambda_1, lambda_2)| <= upper + P instead, and slide against u with
/// |(lambda_1, lambda_2)| = upper + P + k |(u_1, u_2)|: friction of a tip on a surface, the same in all directions.
/// So a box is mu = 0, Coulomb friction -lower = upper = the adhesion, viscous friction k, a unilateral contact [0,
/// inf).
struct ContactRow {
  static constexpr int kNone = -1;

  std::uint64_t id = 0;  ///< stable over steps: what the warm start goes by
  bool bilateral = true;
  double compliance = 0;                    ///< c >= 0, m/N
  double lower = 0;                         ///< N
  double upper = 0;                         ///< N
  double viscosity = 0;                     ///< k >= 0, N/m: N s/m over the step's time
  bool viscous_upper = true;                ///< false: k = 0 at the upper bound (what cuts resists in one direction)
  double friction = 0;                      ///< mu >= 0
  std::array<int, 2> normal{kNone, kNone};  ///< rows that press this one: two lateral ones, or a unilateral one
  int across = kNone;  ///< the other row of a disc: named by both, with equal upper, k, mu and normal rows
};

ContactRow bilateral_row(std::uint64_t id, double compliance = 0);
ContactRow unilateral_row(std::uint64_t id, double compliance = 0);
ContactRow box_row(std::uint64_t id, double lower, double upper, double compliance = 0);
/// |lambda| <= adhesion + friction |lambda_normal|, and k outside.
ContactRow friction_row(std::uint64_t id, double adhesion, double friction, std::array<int, 2> normal,
                        double viscosity = 0, double compliance = 0);

/// One of the two rows of a disc; `across` is the index of the other.
ContactRow disc_row(std::uint64_t id, int across, double adhesion, double friction, std::array<int, 2> normal,
                    double compliance = 0, double viscosity = 0);

struct BoundedSolveLimits {
  int pivots = 100;  ///< solves for the states of the bounded rows, all updates of the bounds together
  int bound_updates = 30;
  int sweeps = 50;  ///< projected Gauss-Seidel, where the above did not suffice
};

struct BoundedSolveReport {
  bool solved = false;  ///< false: input not finite or a row without compliance; lambda was left as it was
  /// Limits reached, so solved exactly for bounds held at those of the first guess, the forces of the step before.
  bool lagged_bounds = false;
  bool fallback = false;  ///< limits reached there too: lambda is what Gauss-Seidel had after its sweeps
  int pivots = 0;
  int bound_updates = 0;  ///< 0: no bound depends on a multiplier, or the first guess was right
  int softened_rows = 0;  ///< rows that depend on others, made soft
  /// Of the bilateral rows, m/N: what the row that depends most on those before it has left to move by. +inf without
  /// any.
  double smallest_pivot = std::numeric_limits<double>::infinity();
  /// Largest distance of a row from its law, |y - clamp(y - u/w_ii, lower - P, upper + P)| with y = lambda + k u,
  /// over the largest force, max |lambda_i| and |delta_i| / w_ii. At most 1e-12 where neither of the above was
  /// needed.
  double residual = 0;
};

/// Eliminates the bilateral rows once (L D L^T), pivots on the Schur complement of the bounded ones (BoxPivoting),
/// and iterates their bounds, which depend on the multipliers that result, to a fixed point of 1e-13 by Newton's
/// method. A disc is two sticking rows that yield by g, u = -g lambda, with the one g >= 0 that puts |lambda| on the
/// bound b, or b / (1 - k g) where it is viscous, an unknown of the same Newton steps. The result is the solution of
/// the equations above and depends neither on the first guess nor on the limits, unless the report says otherwise.
/// With given bounds there is always one solution. Bounds that depend on multipliers make the problem non-monotone:
/// with large mu times coupling there can be several solutions or none, as in Coulomb friction elsewhere; the bounds
/// are then held at those of the first guess.
class BoundedSolver {
public:
  /// @param max_rows  capacity; all memory is taken here
  explicit BoundedSolver(int max_rows);

  /// @param rows              in any order; fastest with the bilateral ones first                    [m]
  /// @param w                 Delassus operator, the lower triangle is read                          [m x m], m/N
  /// @param delta             relative motion without contact forces                                 [m], m
  /// @param[in,out] lambda    first guess (of the bounds; any will do), then the solution            [m], N
  /// @realtime no allocation; O(m^3 / 6) and O(b^3 / 6) a pivot, b the bounded rows that stick
  BoundedSolveReport solve(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                           const Eigen::Ref<const Eigen::VectorXd>& delta,
                           Eigen::Ref<Eigen::VectorXd> lambda) noexcept;

  /// Starts the next solve from all rows sticking.
  void forget();
  void set_limits(const BoundedSolveLimits& limits) { limits_ = limits; }

  /// Of the last solve: the relative motion u of every row, m; exactly 0 in bilateral and sticking rows.    [m]
  std::span<const double> motion() const { return {motion_.data(), static_cast<std::size_t>(count_)}; }
  /// State of a row, and its compliance with the softening that dependent rows got.
  RowState state(int row) const { return states_[row]; }
  double compliance(int row) const { return compliance_[row]; }
  /// Of a bounded row: how far it moves for a force along it while the bilateral rows hold and the other bounded ones
  /// keep their forces, its own compliance included, m/N.
  double response(int row) const { return schur_(place_[row], place_[row]); }

private:
  bool eliminate(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                 const Eigen::Ref<const Eigen::VectorXd>& delta, BoundedSolveReport& report);
  void recall_states(std::span<const ContactRow> rows);
  void remember_states(std::span<const ContactRow> rows);
  bool solve_bounds(std::span<const ContactRow> rows, bool held, BoundedSolveReport& report);
  void set_bounds(std::span<const ContactRow> rows);
  bool pivot(BoundedSolveReport& report, int most_pivots);
  struct BoundError {
    double error = 0;
    double scale = 0;
  };
  BoundError bound_error(std::span<const ContactRow> rows);
  void newton_update(std::span<const ContactRow> rows);
  void plain_update(std::span<const ContactRow> rows);
  void yield(const std::array<int, 2>& disc, double bound);
  double radius(std::span<const ContactRow> rows, const std::array<int, 2>& disc) const;
  double sliding_force(std::span<const ContactRow> rows, const std::array<int, 2>& disc) const;
  void recover_leading();
  double press(const ContactRow& row) const;
  void linearise_press(std::span<const ContactRow> rows);
  bool factorise_newton(std::span<const ContactRow> rows);
  void solve_newton(Eigen::VectorXd& x) const;
  void sweep(std::span<const ContactRow> rows);
  void settle_motion(std::span<const ContactRow> rows);
  double residual(std::span<const ContactRow> rows, const Eigen::Ref<const Eigen::MatrixXd>& w,
                  const Eigen::Ref<const Eigen::VectorXd>& delta);

  BoundedSolveLimits limits_;
  int count_ = 0;
  std::vector<int> leading_;  // caller's index of every bilateral row
  std::vector<int> bounded_;  // and of every bounded row
  std::vector<int> place_;    // of the caller's rows within their group
  PanelLdl elimination_;
  BoxPivoting pivoting_;
  Eigen::MatrixXd schur_;    // both triangles
  Eigen::VectorXd reduced_;  // [y; d]: delta after the forward elimination
  Eigen::VectorXd work_;
  Eigen::VectorXd multipliers_;  // caller's order
  Eigen::VectorXd motion_;
  Eigen::VectorXd compliance_;  // with softening
  // Bounded rows, in the order of bounded_.
  std::vector<RowState> reduced_states_;
  std::vector<double> softening_, diagonal_, lower_, upper_, viscosity_, base_lower_, base_upper_, yielding_;
  std::vector<double> viscosity_upper_;
  Eigen::VectorXd lambda_, u_, press_, pressed_;
  std::vector<std::array<int, 2>> discs_;
  bool held_ = false;  // bounds do not follow the multipliers
  // Newton on the bounds.
  Eigen::MatrixXd coupling_;  // (W_nn^-1 W_nt)^T
  bool has_coupling_ = false;
  Eigen::MatrixXd press_gradient_;  // column i: dP_i / dlambda_t
  Eigen::MatrixXd newton_;          // column i: equation i, as L U
  std::vector<int> newton_pivots_;
  int newton_size_ = 0;
  bool has_newton_ = false;
  std::vector<int> sliding_discs_;  // those in the equations, behind the rows
  Eigen::VectorXd newton_step_;
  std::vector<RowState> newton_states_;
  // Warm start.
  std::vector<RowState> states_;  // caller's order
  std::vector<std::uint64_t> remembered_ids_;
  std::vector<RowState> remembered_states_;
  std::vector<double> remembered_yielding_;
};

}  // namespace stylet::physics
