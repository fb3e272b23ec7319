// Textbook dense finite elements: an oracle that shares no formula with physics/tissue.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::support {

/// A corotational body over all 3 x nodes DOFs: strain-displacement matrix B (6 x 12), K0 = V B^T C B, polar rotation
/// by SVD, f = R K0 (R^T x - X), K = R K0 R^T. Slow and plain.
class DenseTissue {
public:
  DenseTissue(physics::TetMesh mesh, std::vector<physics::ElasticMaterial> materials,
              std::span<const int> fixed_nodes);

  /// F_int(p) over all DOFs, N.  p: [3 nodes] interleaved.
  Eigen::VectorXd forces(const Eigen::VectorXd& p) const;
  /// K(p) without the derivative of the rotations, over all DOFs, N/m.
  Eigen::MatrixXd stiffness(const Eigen::VectorXd& p) const;
  /// K(p) restricted to the free DOFs, in node order.
  Eigen::MatrixXd free_stiffness(const Eigen::VectorXd& p) const;
  Eigen::VectorXd rest() const;
  const std::vector<int>& free_dofs() const { return free_dofs_; }

private:
  physics::TetMesh mesh_;
  std::vector<Eigen::Matrix<double, 12, 12>> k0_;
  std::vector<Eigen::Matrix3d> inverse_edges_;
  std::vector<int> free_dofs_;
};

}  // namespace stylet::support
