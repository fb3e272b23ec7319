// Sparse stiffness of a body: a fixed pattern, and a map that scatters element blocks into it.
#pragma once

#include "physics/tissue/inversion.h"
#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <span>
#include <vector>

namespace stylet::physics {

/// Pattern of the lower triangle over the free DOFs, compressed columns, rows ascending.
class StiffnessPattern {
public:
  explicit StiffnessPattern(const TissueModel& model);

  int dof_count() const { return static_cast<int>(column_start_.size()) - 1; }
  std::size_t nonzeros() const { return rows_.size(); }
  std::span<const int> column_start() const { return column_start_; }  ///< [DOFs + 1]
  std::span<const int> rows() const { return rows_; }                  ///< [nonzeros]

  /// A = (1 + damping_time / h) K, K = sum R K0 R^T over the tetrahedra   (physics/README.md eq. 4, 5, 38)
  /// @param rotations    [points] rest -> deformed
  /// @param scale        1 + damping_time / h
  /// @param[out] values  overwritten [nonzeros], N/m
  /// @param squeezed     of the same state: those whose barrier adds to K
  /// @param cofactors    of quadratic elements [points], of the same state; empty: the rotations, as without stretch
  /// @param stiffening   the same; empty: as without stretch
  /// @param membrane     of the capsule's triangles, of the same state; empty: at rest
  void assemble(const TissueModel& model, std::span<const Eigen::Quaterniond> rotations, double scale,
                std::span<double> values, std::span<const SqueezedTet> squeezed = {},
                std::span<const Eigen::Matrix3d> cofactors = {}, std::span<const PointStiffness> stiffening = {},
                std::span<const MembraneGradient> membrane = {}) const;

private:
  void assemble_quadratic(const TissueModel& model, std::span<const Eigen::Quaterniond> rotations, double scale,
                          std::span<double> values, std::span<const SqueezedTet> squeezed,
                          std::span<const Eigen::Matrix3d> cofactors,
                          std::span<const PointStiffness> stiffening) const;
  void add_membrane(const TissueModel& model, double scale, std::span<const MembraneGradient> membrane,
                    std::span<double> values) const;
  /// Where the 3x3 block of a pair of an element's nodes is: row r of column c at start[c] + r.
  struct BlockAddress {
    int row = 0;                           // of the element's nodes, the one with the larger free index
    int column = 0;                        // the other
    std::array<int, 3> start{-1, -1, -1};  // -1: one of them is fixed
  };
  std::vector<int> column_start_;
  std::vector<int> rows_;
  std::vector<BlockAddress> scatter_;           // [elements x pairs of an element's nodes]
  std::vector<BlockAddress> membrane_scatter_;  // [triangles of the capsule x pairs]
};

}  // namespace stylet::physics
