// The Delassus operator: how the contact rows influence each other through the needle and the tissue.
#pragma once

#include "physics/contact/active_contact.h"
#include "physics/contact/tissue_points.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::physics {

/// W = H_n A_n^-1 H_n^T + sum over bodies of H_v W_bar H_v^T   (physics/README.md eq. 14, paper eq. 5).
/// A row of a contact with direction n:
///   H_n: weights[i] n^T on the translation and (arms[i] x n)^T on the spin of the beam's two nodes (ShaftPoint);
///   H_v: -n^T times the barycentric weights on the four nodes of the tetrahedron.
/// A row that turns the shaft (ActiveContact::lever): lever n^T on the spins, linear along the beam as its twist is,
/// and no H_v, because the points of a mesh do not turn.
class Delassus {
public:
  /// @param node_count  of the needle
  /// @param max_rows    capacity; all memory is taken here
  Delassus(int node_count, int max_rows);

  /// Assembles W at the last linearisation of the needle: place_rows(), then couple().
  /// @realtime no allocation; O(nodes rows^2), a third of that for contacts in order from hub to tip along the needle
  void assemble(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts,
                int contact_count);
  /// H_n^T of the contacts. H_v is not stored: it is the directions and the patch's barycentric weights.
  void place_rows(const Needle& needle, const std::vector<ActiveContact>& contacts, int contact_count);
  /// W of the rows placed. Uses them up.
  void couple(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts);

  int rows() const { return rows_; }
  /// W, m/N; the lower triangle is filled [rows x rows].
  auto matrix() const { return w_.topLeftCorner(rows_, rows_); }
  /// mean(diag W_v), m/N: the scale of the tissue's own compliance.
  double mean_tissue_compliance() const { return mean_tissue_compliance_; }

private:
  void add_needle(const Needle& needle);
  void add_tissue(const TissuePoints& tissue, const std::vector<ActiveContact>& contacts);

  int contact_count_ = 0;
  int rows_ = 0;
  double mean_tissue_compliance_ = 0;
  Eigen::MatrixXd w_;            // [row_stride_ x row_stride_]
  std::vector<double> forward_;  // H_n^T, then L^-1 H_n^T, row-major [6 node_count x row_stride_]
  int row_stride_;               // whole tiles
  std::vector<int> first_node_;  // [row_stride_] of a row's non-zeros in L^-1 H_n^T: that of its beam
  std::vector<int> reached_;     // [node_count] rows that may be non-zero up to a node, the first ones
};

/// Rows of contacts whose first_row counts up from 0.
int row_count(const std::vector<ActiveContact>& contacts, int contact_count);

/// delta = H_n p - H_v x for shaft points moved by `motion` and tissue points free of the needle: the violation after
/// the free motions   (physics/README.md eq. 14, paper eq. 3).
/// @param motion      translations and spins [6 nodes]
/// @param[out] delta  [rows], m
/// @realtime
void free_violation(Eigen::Ref<const Eigen::VectorXd> motion, const TissuePoints& tissue,
                    const std::vector<ActiveContact>& contacts, int contact_count, Eigen::Ref<Eigen::VectorXd> delta);

/// load = H_n^T lambda: forces on the needle's nodes [6 nodes].
/// @realtime
void needle_load(const std::vector<ActiveContact>& contacts, int contact_count,
                 Eigen::Ref<const Eigen::VectorXd> lambda, Eigen::Ref<Eigen::VectorXd> load);

}  // namespace stylet::physics
