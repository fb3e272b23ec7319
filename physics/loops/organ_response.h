// What the contacts of the bodies do when the needle's forces change, from one update of OrganContact to the next.
#pragma once

#include "physics/contact/box_pivoting.h"
#include "physics/contact/organ_contact.h"
#include "physics/messages/messages.h"
#include "physics/tissue/factorisation_worker.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace stylet::physics {

/// A body as the rows are linearised: at p_free, with the factor in use.
struct OrganResponseBody {
  const TissueModel& model;
  const IsolatedDofs& isolated;
  std::span<const int> patch_nodes;  ///< of the patch; a node whose compliance is not known is held
};

/// The rows of the simulation's own share of README eq. 31b: those whose nodes have a known compliance, at most
/// kMaxOrganRows, the ones that the needle moves most. The haptic loop is sent the same rows, so that both make the
/// same of the same forces. One thread.
class OrganResponse {
public:
  OrganResponse();

  void clear() { count_ = 0; }
  /// Chooses rows of the last update of OrganContact and makes their W.
  /// @param companion  takes a part of it, or null
  void choose(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies, Companion* companion);
  /// Nodes of the chosen rows whose p_free is asked for, of a body.
  std::span<const int> nodes(int body) const { return nodes_[body]; }
  /// How p_free opens the gaps against the positions that the rows were found at.
  /// @param moved  p_free - p of nodes(body) [3 x nodes], bodies in order, m
  void open(std::span<const SurfaceRow> rows, std::span<const Eigen::Matrix3Xd> moved);
  /// For the haptic loop.
  /// @param out  reserved
  void fill(std::span<const SurfaceRow> rows, OrganRows& out) const;
  /// Multipliers under needle forces.
  /// @param bodies  with the factor and the known nodes that choose() had
  /// @param forces  [free DOFs] of each body, N, zero but at `loaded`
  /// @return whether there are any
  bool respond(std::span<const OrganResponseBody> bodies, std::span<const Eigen::VectorXd* const> forces,
               std::span<const std::vector<int>* const> loaded);

  /// Adds what the last respond() moves a body by, if it has found any: of known nodes, by their place.
  /// @param motion  [3 known nodes], m
  void add_motion(int body, Eigen::Ref<Eigen::VectorXd> motion) const;

  int count() const { return count_; }
  std::span<const int> rows() const { return {chosen_.data(), static_cast<std::size_t>(count_)}; }
  auto lambda() const { return lambda_.head(count_); }  ///< of the last respond() [count]

private:
  // The stages of choose(), in order.
  void find_motions(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies,
                    Companion* companion);
  void find_nodes(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies);
  void couple(std::span<const SurfaceRow> rows, std::span<const OrganResponseBody> bodies);

  int count_ = 0;
  std::vector<char> known_;                         // [rows] whether their compliance is
  std::vector<IsolatedDofs::Push> pushes_;          // scratch
  std::vector<int> chosen_;                         // [count_] indices of rows
  std::array<std::vector<int>, kMaxBodies> nodes_;  // of the chosen rows, free
  std::array<std::array<int, 4>, kMaxOrganRows>
      at_{};                                         // [count_] [supports] in nodes_ of the support's body; -1: held
  std::array<std::vector<int>, kMaxBodies> places_;  // of the patch nodes among the known ones, -1
  std::array<Eigen::MatrixXd, kMaxBodies> motions_;  // [3 known nodes x rows, or more] per force on a row, m/N
  Eigen::MatrixXd w_;
  Eigen::VectorXd gap_, lambda_0_, lambda_, u_, d_;
  std::vector<RowState> states_;
  std::vector<double> diagonal_, softening_, zeros_, unbounded_;
  BoxPivoting pivoting_;
};

}  // namespace stylet::physics
