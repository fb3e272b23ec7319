// Contacts between the bodies, and of the probe, as the haptic loop feels them between two simulation steps.
#pragma once

#include "physics/contact/box_pivoting.h"
#include "physics/contact/panel_ldl.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::physics {

/// The rows A of a patch that carry force are folded into the compliance of what the needle touches (README eq. 31b):
///   W~ = W_bar - Y_A W_AA^-1 Y_A^T,   x = p_free + Y d + W~ f,   d the change of lambda without needle force
/// After the solve of a haptic step settle() finds by exact pivoting which rows carry force now; where these are
/// others than before, the next step is folded anew. So a step knows the rows of the step before, and bodies part and
/// meet at haptic rate.
/// @realtime nothing after the constructor allocates
class OrganCoupling {
public:
  OrganCoupling();

  void clear();
  /// Takes the rows of a patch. Those that the last patch had too carry force if they did, the others if lambda_0 >
  /// 0.
  void load(const OrganRows& rows);
  int rows() const { return rows_; }
  /// How many of them carry force.
  int carrying() const { return carrying_; }

  /// Y^T of a material point: opening of every gap per force on it [rows x 3], m/N.
  void openings(const TissuePatch& patch, int body, const PatchContact& point, Eigen::Ref<Eigen::MatrixXd> y) const;
  /// z with z_i^T z_j = y_i^T W_AA^-1 y_j [carrying x 3]
  void fold(const Eigen::Ref<const Eigen::MatrixXd>& y, Eigen::Ref<Eigen::MatrixXd> z);
  /// lambda - lambda_0 without needle force [rows], N
  auto free_change() const { return free_change_.head(rows_); }
  /// lambda - lambda_0 under the forces of the last settle() [rows], N
  auto change() const { return change_.head(rows_); }

  /// Multipliers under needle forces that open the gaps by `moved` [rows], m.
  /// @return whether other rows carry force than before: fold() and free_change() have changed
  bool settle(const Eigen::Ref<const Eigen::VectorXd>& moved);

private:
  void factorise();

  int rows_ = 0;
  int carrying_ = 0;
  std::array<std::uint64_t, kMaxOrganRows> ids_{};
  std::array<RowState, kMaxOrganRows> states_{};  // sticking: carries force
  std::array<int, kMaxOrganRows> active_{};       // [carrying_] rows
  Eigen::MatrixXd w_;
  Eigen::VectorXd gap_, lambda_0_, intercept_;  // intercept_: u at lambda = 0 without needle force
  Eigen::VectorXd free_change_, change_;
  BoxPivoting pivoting_;
  PanelLdl factor_;  // of W_AA
  // scratch
  std::array<RowState, kMaxOrganRows> next_{};
  std::array<std::uint64_t, kMaxOrganRows> old_ids_{};
  std::vector<double> softening_, diagonal_, zeros_, unbounded_;
  Eigen::VectorXd d_, next_lambda_, u_, column_;
};

/// 0 <= lambda, 0 <= u = W lambda + d, one of the two zero: which rows carry force, by exact pivoting.
/// @param w               as BoxPivoting::load() left it
/// @param zeros, infinite  [rows] what they say
/// @param[in,out] states  a first guess, then the solution's; sticking: carries force
/// @return whether it was solved
/// @realtime
bool solve_unilateral(BoxPivoting& pivoting, const Eigen::Ref<const Eigen::MatrixXd>& w, const Eigen::VectorXd& d,
                      const std::vector<double>& zeros, const std::vector<double>& infinite, RowState* states,
                      Eigen::VectorXd& lambda, Eigen::VectorXd& u);

}  // namespace stylet::physics
