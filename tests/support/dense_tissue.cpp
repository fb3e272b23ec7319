#include "tests/support/dense_tissue.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <utility>

namespace stylet::support {
namespace {

using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

Eigen::Matrix3d edges(const std::array<int, 4>& tet, const Eigen::VectorXd& p) {
  Eigen::Matrix3d e;
  for (std::size_t a = 1; a < 4; ++a)
    e.col(Eigen::Index(a) - 1) = p.segment<3>(3 * tet[a]) - p.segment<3>(3 * tet[0]);
  return e;
}

Matrix12 rotation12(const Eigen::Matrix3d& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Eigen::Matrix3d r = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  Matrix12 all = Matrix12::Zero();
  for (int a = 0; a < 4; ++a) all.block<3, 3>(3 * a, 3 * a) = r;
  return all;
}

Vector12 gather(const std::array<int, 4>& tet, const Eigen::VectorXd& p) {
  Vector12 x;
  for (std::size_t a = 0; a < 4; ++a) x.segment<3>(3 * Eigen::Index(a)) = p.segment<3>(3 * tet[a]);
  return x;
}

}  // namespace

DenseTissue::DenseTissue(physics::TetMesh mesh, std::vector<physics::ElasticMaterial> materials,
                         std::span<const int> fixed_nodes)
    : mesh_(std::move(mesh)) {
  const Eigen::VectorXd x = rest();
  for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
    // Natural coordinates: N = [1 x y z] C, the columns of the inverse of the nodal coordinate matrix.
    Eigen::Matrix4d coordinates;
    for (std::size_t a = 0; a < 4; ++a) {
      coordinates.row(Eigen::Index(a)) << 1, mesh_.nodes[mesh_.tets[t][a]].transpose();
    }
    const Eigen::Matrix4d shape = coordinates.inverse();
    Eigen::Matrix<double, 6, 12> b = Eigen::Matrix<double, 6, 12>::Zero();
    for (int a = 0; a < 4; ++a) {
      const double dx = shape(1, a);
      const double dy = shape(2, a);
      const double dz = shape(3, a);
      b.block<6, 3>(0, 3 * a) << dx, 0, 0, 0, dy, 0, 0, 0, dz, dy, dx, 0, 0, dz, dy, dz, 0, dx;
    }
    const double e = materials[t].young_modulus;
    const double nu = materials[t].poisson_ratio;
    Eigen::Matrix<double, 6, 6> c = Eigen::Matrix<double, 6, 6>::Zero();
    c.topLeftCorner<3, 3>().setConstant(nu);
    c.topLeftCorner<3, 3>().diagonal().setConstant(1 - nu);
    c.bottomRightCorner<3, 3>().diagonal().setConstant((1 - 2 * nu) / 2);
    c *= e / ((1 + nu) * (1 - 2 * nu));
    k0_.push_back(coordinates.determinant() / 6 * b.transpose() * c * b);
    inverse_edges_.push_back(edges(mesh_.tets[t], x).inverse());
  }
  for (int n = 0; n < int(mesh_.nodes.size()); ++n) {
    if (std::find(fixed_nodes.begin(), fixed_nodes.end(), n) != fixed_nodes.end()) continue;
    for (int c = 0; c < 3; ++c) free_dofs_.push_back(3 * n + c);
  }
}

Eigen::VectorXd DenseTissue::rest() const {
  Eigen::VectorXd x(3 * Eigen::Index(mesh_.nodes.size()));
  for (std::size_t n = 0; n < mesh_.nodes.size(); ++n) x.segment<3>(3 * Eigen::Index(n)) = mesh_.nodes[n];
  return x;
}

Eigen::VectorXd DenseTissue::forces(const Eigen::VectorXd& p) const {
  Eigen::VectorXd f = Eigen::VectorXd::Zero(p.size());
  const Eigen::VectorXd x = rest();
  for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
    const auto& tet = mesh_.tets[t];
    const Matrix12 r = rotation12(edges(tet, p) * inverse_edges_[t]);
    const Vector12 local = r * (k0_[t] * (r.transpose() * gather(tet, p) - gather(tet, x)));
    for (std::size_t a = 0; a < 4; ++a) f.segment<3>(3 * tet[a]) += local.segment<3>(3 * Eigen::Index(a));
  }
  return f;
}

Eigen::MatrixXd DenseTissue::stiffness(const Eigen::VectorXd& p) const {
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(p.size(), p.size());
  for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
    const auto& tet = mesh_.tets[t];
    const Matrix12 r = rotation12(edges(tet, p) * inverse_edges_[t]);
    const Matrix12 turned = r.lazyProduct(k0_[t]);
    const Matrix12 local = turned.lazyProduct(r.transpose());
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        k.block<3, 3>(3 * tet[a], 3 * tet[b]) += local.block<3, 3>(3 * Eigen::Index(a), 3 * Eigen::Index(b));
      }
    }
  }
  return k;
}

Eigen::MatrixXd DenseTissue::free_stiffness(const Eigen::VectorXd& p) const {
  return stiffness(p)(free_dofs_, free_dofs_);
}

}  // namespace stylet::support
