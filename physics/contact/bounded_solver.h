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
  double friction = 0;                      ///< mu >= 0
  std::array<int, 2> normal{kNone, kNone};  ///< rows that press this one: two lateral ones, or a unilateral one
};

ContactRow bilateral_row(std::uint64_t id, double compliance = 0);
ContactRow unilateral_row(std::uint64_t id, double compliance = 0);
ContactRow box_row(std::uint64_t id, double lower, double upper, double compliance = 0);
/// |lambda| <= adhesion + friction |lambda_normal|, and k outside.
ContactRow friction_row(std::uint64_t id, double adhesion, double friction, std::array<int, 2> normal,
                        double viscosity = 0, double compliance = 0);

struct BoundedSolveLimits {
  int pivots = 200;  ///< solves for the states of the bounded rows, all updates of the bounds together
  int bound_updates = 40;
  int sweeps = 100;  ///< projected Gauss-Seidel, where the above did not suffice
};

struct BoundedSolveReport {
  bool solved = false;    ///< false: input not finite or a row without compliance; lambda was left as it was
  bool fallback = false;  ///< limits reached; lambda is what Gauss-Seidel had after its sweeps
  int pivots = 0;
  int bound_updates = 0;  ///< 0: no bound depends on a multiplier, or the first guess was right
  int softened_rows = 0;  ///< rows that depend on others, made soft
  /// Largest distance of a row from its law, |y - clamp(y - u/w_ii, lower - P, upper + P)| with y = lambda + k u,
  /// over the largest force, max |lambda_i| and |delta_i| / w_ii. At most 1e-12 where no fall-back was needed.
  double residual = 0;
};

/// Eliminates the bilateral rows once (L D L^T), pivots on the Schur complement of the bounded ones (BoxPivoting),
/// and iterates their bounds, which depend on the multipliers that result, to a fixed point of 1e-12 by Newton's
/// method. The result is the solution of the equations above and depends neither on the first guess nor on the
/// limits, unless the report says fall-back. Bounds that depend on multipliers make the problem non-monotone: with
/// very large mu times coupling there can be several solutions or none, as in Coulomb friction elsewhere; the report
/// then says fall-back.
class BoundedSolver {
public:
  /// @param max_rows  capacity; all memory is taken here
  explicit BoundedSolver(int max_rows);

  /// @param rows              in any order; fastest with the bilateral ones first                    [m]
  /// @param w                 Delassus operator, the lower triangle is read                          [m x m], m/N
  /// @param delta             relative motion without contact forces                                 [m], m
  /// @param[in,out] lambda    first guess (of the bounds; any will do), then the solution            [m], N
  /// @realtime no allocation; O(m^3 / 6) and O(b^3 / 6) a pivot, b the bounded rows that stick
  BoundedSolveReport solve(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                           Eigen::Ref<const Eigen::VectorXd> delta, Eigen::Ref<Eigen::VectorXd> lambda) noexcept;

  /// Starts the next solve from all rows sticking.
  void forget();
  void set_limits(const BoundedSolveLimits& limits) { limits_ = limits; }

  /// Of the last solve: the relative motion u of every row, m, softening included; 0 in bilateral and sticking rows
  /// up to rounding.                                                                                   [m]
  std::span<const double> motion() const { return {motion_.data(), static_cast<std::size_t>(count_)}; }
  /// State of a row, and its compliance with the softening that dependent rows got.
  RowState state(int row) const { return states_[row]; }
  double compliance(int row) const { return compliance_[row]; }

private:
  bool eliminate(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                 Eigen::Ref<const Eigen::VectorXd> delta, BoundedSolveReport& report);
  void recall_states(std::span<const ContactRow> rows);
  void remember_states(std::span<const ContactRow> rows);
  bool solve_bounds(std::span<const ContactRow> rows, BoundedSolveReport& report);
  void spread_bounds();
  void recover_leading();
  double press(const ContactRow& row) const;
  void linearise_press(std::span<const ContactRow> rows);
  bool factorise_newton(std::span<const ContactRow> rows);
  void solve_newton(Eigen::VectorXd& x) const;
  void sweep(std::span<const ContactRow> rows);
  void settle_motion();
  double residual(std::span<const ContactRow> rows, Eigen::Ref<const Eigen::MatrixXd> w,
                  Eigen::Ref<const Eigen::VectorXd> delta);

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
  std::vector<double> softening_, diagonal_, lower_, upper_, viscosity_, base_lower_, base_upper_;
  Eigen::VectorXd lambda_, u_, press_, pressed_;
  // Newton on the bounds.
  Eigen::MatrixXd coupling_;  // (W_nn^-1 W_nt)^T
  bool has_coupling_ = false;
  Eigen::MatrixXd press_gradient_;  // column i: dP_i / dlambda_t
  Eigen::MatrixXd newton_;          // column i: equation i, as L U
  std::vector<int> newton_pivots_;
  Eigen::VectorXd newton_step_;
  std::vector<RowState> newton_states_;
  // Warm start.
  std::vector<RowState> states_;  // caller's order
  std::vector<std::uint64_t> remembered_ids_;
  std::vector<RowState> remembered_states_;
};

}  // namespace stylet::physics
