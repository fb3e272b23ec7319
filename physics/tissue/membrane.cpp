#include "physics/tissue/membrane.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>

namespace stylet::physics {
namespace {

/// D = det C below which its energy goes on in a straight line: a triangle of a tenth of its area.
constexpr double kFlat = 0.01;

/// -dW/dD over half the shear modulus: W = mu/2 (tr C + 1/D - 3).
double inverse_square(double d) {
  const double kept = std::max(d, kFlat);
  return 1 / (kept * kept);
}

Eigen::Matrix2d adjugate(const Eigen::Matrix2d& c) {
  Eigen::Matrix2d result;
  result << c(1, 1), -c(0, 1), -c(1, 0), c(0, 0);
  return result;
}

/// Second Piola-Kirchhoff stress 2 dW/dC of the sheet times its volume, J.
Eigen::Matrix2d stress(const MembraneTriangle& triangle, const Eigen::Matrix2d& c) {
  return triangle.shear_energy * (Eigen::Matrix2d::Identity() - inverse_square(c.determinant()) * adjugate(c));
}

}  // namespace

std::vector<MembraneTriangle> membrane_of(const TetMesh& mesh, const TetTopology& topology, double stiffness) {
  std::vector<MembraneTriangle> triangles;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (int face = 0; face < 4; ++face) {
      if (topology.neighbour(static_cast<int>(t), face) >= 0) continue;
      MembraneTriangle triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        triangle.nodes[k] = mesh.tets[t][static_cast<std::size_t>(kFaceCorners[static_cast<std::size_t>(face)][k])];
      }
      const Eigen::Vector3d a = mesh.nodes[triangle.nodes[1]] - mesh.nodes[triangle.nodes[0]];
      const Eigen::Vector3d b = mesh.nodes[triangle.nodes[2]] - mesh.nodes[triangle.nodes[0]];
      const Eigen::Vector3d normal = a.cross(b);
      triangle.frame.col(0) = a.normalized();
      triangle.frame.col(1) = normal.normalized().cross(triangle.frame.col(0));
      Eigen::Matrix2d edges;
      edges << triangle.frame.transpose() * a, triangle.frame.transpose() * b;
      triangle.gradients.rightCols<2>() = edges.inverse().transpose();
      triangle.gradients.col(0) = -triangle.gradients.rightCols<2>().rowwise().sum();
      triangle.shear_energy = stiffness / 3 * 0.5 * normal.norm();
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

MembraneGradient membrane_gradient(const MembraneTriangle& triangle, const Eigen::Matrix3Xd& positions) {
  Eigen::Matrix3d x;
  for (int a = 0; a < 3; ++a) x.col(a) = positions.col(triangle.nodes[static_cast<std::size_t>(a)]);
  return x * triangle.gradients.transpose();
}

void add_membrane_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions, bool linearised,
                         Eigen::Ref<Eigen::Matrix3Xd> forces) {
  for (const MembraneTriangle& triangle : model.membrane) {
    if (linearised) {
      const MembraneStiffness stiffness(triangle, triangle.frame);
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
          const int node = triangle.nodes[static_cast<std::size_t>(b)];
          forces.col(triangle.nodes[static_cast<std::size_t>(a)]) +=
              stiffness.block(a, b) * (positions.col(node) - model.mesh.nodes[static_cast<std::size_t>(node)]);
        }
      }
      continue;
    }
    const MembraneGradient f = membrane_gradient(triangle, positions);
    const Eigen::Matrix3d force = f * stress(triangle, f.transpose() * f) * triangle.gradients;
    for (int a = 0; a < 3; ++a) forces.col(triangle.nodes[static_cast<std::size_t>(a)]) += force.col(a);
  }
}

double membrane_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions) {
  double energy = 0;
  for (const MembraneTriangle& triangle : model.membrane) {
    const MembraneGradient f = membrane_gradient(triangle, positions);
    const Eigen::Matrix2d c = f.transpose() * f;
    const double d = c.determinant();
    const double inverse = d > kFlat ? 1 / d : 1 / kFlat + (kFlat - d) / (kFlat * kFlat);
    energy += 0.5 * triangle.shear_energy * (c.trace() + inverse - 3);
  }
  return energy;
}

MembraneStiffness::MembraneStiffness(const MembraneTriangle& triangle, const MembraneGradient& f) {
  Eigen::Matrix2d c = f.transpose() * f;
  const Eigen::Matrix2d s = stress(triangle, c);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(s);
  const Eigen::Matrix2d tension = principal.eigenvectors() * principal.eigenvalues().cwiseMax(0).asDiagonal() *
                                  principal.eigenvectors().transpose();
  // Flatter than the energy knows: as stiff as where it goes on straight, so that there is an inverse.
  const double d = c.determinant();
  if (d < kFlat) c.diagonal().array() += kFlat;
  const Eigen::Matrix2d inverse = c.inverse();
  dual_ = f * inverse * triangle.gradients;
  inner_ = triangle.gradients.transpose() * inverse * triangle.gradients;
  projector_ = f * inverse * f.transpose();
  tension_ = triangle.gradients.transpose() * tension * triangle.gradients;
  material_ = 2 * triangle.shear_energy / std::max(d, kFlat);
}

Eigen::Matrix3d MembraneStiffness::block(int a, int b) const {
  Eigen::Matrix3d k = material_ * (0.5 * (dual_.col(b) * dual_.col(a).transpose() + inner_(a, b) * projector_) +
                                   dual_.col(a) * dual_.col(b).transpose());
  k.diagonal().array() += tension_(a, b);
  return k;
}

}  // namespace stylet::physics
