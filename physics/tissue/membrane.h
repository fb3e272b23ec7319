// A capsule: a membrane over the surface of a body, that resists being stretched and nothing else.
//
// Triangles of an incompressible neo-Hookean sheet on the surface's own nodes (physics/README.md eq. 49).
#pragma once

#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// How a triangle lies: its deformation gradient, from its plane at rest.
using MembraneGradient = Eigen::Matrix<double, 3, 2>;

/// The triangles of a body's whole surface.
/// @param stiffness  Young's modulus of the sheet times its thickness, N/m
std::vector<MembraneTriangle> membrane_of(const TetMesh& mesh, const TetTopology& topology, double stiffness);

MembraneGradient membrane_gradient(const MembraneTriangle& triangle, const Eigen::Matrix3Xd& positions);

/// forces += the gradient of membrane_energy().
/// @param linearised      at rest: linear in the positions
/// @param[in,out] forces  [3 x nodes], N
void add_membrane_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions, bool linearised,
                         Eigen::Ref<Eigen::Matrix3Xd> forces);

double membrane_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions);

/// What the stiffness of a triangle is made of, at a state (eq. 50).
class MembraneStiffness {
public:
  MembraneStiffness(const MembraneTriangle& triangle, const MembraneGradient& f);
  /// d^2 U / dx_a dx_b without what compression takes off: positive semidefinite as a whole, N/m.
  Eigen::Matrix3d block(int a, int b) const;

private:
  Eigen::Matrix3d dual_;       // column a: F C^-1 grad N_a, 1/m
  Eigen::Matrix3d inner_;      // grad N_a . C^-1 grad N_b
  Eigen::Matrix3d tension_;    // grad N_a . S+ grad N_b times volume, N/m
  Eigen::Matrix3d projector_;  // onto the triangle's plane
  double material_ = 0;        // 2 mu V / D, J
};

}  // namespace stylet::physics
