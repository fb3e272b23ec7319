#include "physics/tissue/corotational.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace stylet::physics {
namespace {

constexpr int kMaxNewtonIterations = 8;
constexpr double kSmallStep = 1e-7;  // the step after it is below 1e-14: Newton is quadratic here

Eigen::Quaterniond rotation_by_svd(const Eigen::Matrix3d& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3d, Eigen::NoQRPreconditioner> svd(f,
                                                                         Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) = -u.col(2);
  return Eigen::Quaterniond(Eigen::Matrix3d(u * svd.matrixV().transpose())).normalized();
}

/// Stress times volume, rotated into the deformed frame: V R sigma, so that f_a = (V R sigma) grad N_a.
Eigen::Matrix3d rotated_stress(const TetRest& rest, const Eigen::Matrix3d& f, const Eigen::Matrix3d& r) {
  const Eigen::Matrix3d m = r.transpose() * f;
  const Eigen::Matrix3d strain = 0.5 * (m + m.transpose()) - Eigen::Matrix3d::Identity();
  Eigen::Matrix3d stress = 2 * rest.mu * strain;
  stress.diagonal().array() += rest.lambda * strain.trace();
  return rest.volume * r * stress;
}

}  // namespace

Eigen::Quaterniond closest_rotation(const Eigen::Matrix3d& f, const Eigen::Quaterniond& warm_start) {
  if (!(f.determinant() > 0)) return rotation_by_svd(f);
  Eigen::Quaterniond q = warm_start;
  for (int i = 0; i < kMaxNewtonIterations; ++i) {
    const Eigen::Matrix3d m = q.toRotationMatrix().transpose() * f;
    // Ascent of tr(exp(-[w]) M): gradient g, minus Hessian C = tr(M) I - sym(M).
    const Eigen::Vector3d g(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
    const double c00 = m(1, 1) + m(2, 2);
    const double c11 = m(0, 0) + m(2, 2);
    const double c22 = m(0, 0) + m(1, 1);
    const double c01 = -0.5 * (m(0, 1) + m(1, 0));
    const double c02 = -0.5 * (m(0, 2) + m(2, 0));
    const double c12 = -0.5 * (m(1, 2) + m(2, 1));
    // C^-1 g by cofactors: this runs for every tetrahedron at every step.
    const double k00 = c11 * c22 - c12 * c12;
    const double k01 = c02 * c12 - c01 * c22;
    const double k02 = c01 * c12 - c02 * c11;
    const double determinant = c00 * k00 + c01 * k01 + c02 * k02;
    const double minor = c00 * c11 - c01 * c01;
    if (!(c00 > 0 && minor > 0 && determinant > 0)) break;  // C not positive definite: not near a maximum
    const double k11 = c00 * c22 - c02 * c02;
    const double k12 = c01 * c02 - c00 * c12;
    const Eigen::Vector3d w = Eigen::Vector3d(k00 * g[0] + k01 * g[1] + k02 * g[2],  //
                                              k01 * g[0] + k11 * g[1] + k12 * g[2],  //
                                              k02 * g[0] + k12 * g[1] + minor * g[2]) /
                              determinant;
    // (1, w/2) normalised is exp(w) up to third order.
    q = (q * Eigen::Quaterniond(1, 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z())).normalized();
    if (w.squaredNorm() < kSmallStep * kSmallStep) return q;
  }
  return rotation_by_svd(f);
}

Eigen::Matrix3d deformation_gradient(const TissueModel& model, const Eigen::Matrix3Xd& positions, int tet) {
  const auto& n = model.mesh.tets[static_cast<std::size_t>(tet)];
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = positions.col(n[static_cast<std::size_t>(a + 1)]) - positions.col(n[0]);
  return edges * model.tets[static_cast<std::size_t>(tet)].gradients.rightCols<3>().transpose();
}

int update_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<Eigen::Quaterniond> rotations) {
  int inverted = 0;
  for (int t = 0; t < model.tet_count(); ++t) {
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    if (!(f.determinant() > 0)) ++inverted;
    auto& q = rotations[static_cast<std::size_t>(t)];
    q = closest_rotation(f, q);
  }
  return inverted;
}

void internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces) {
  forces.setZero();
  for (int t = 0; t < model.tet_count(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    const TetRest& rest = model.tets[i];
    const Eigen::Matrix3d p =
        rotated_stress(rest, deformation_gradient(model, positions, t), rotations[i].toRotationMatrix());
    const auto& n = model.mesh.tets[i];
    for (int a = 0; a < 4; ++a) forces.col(n[static_cast<std::size_t>(a)]) += p * rest.gradients.col(a);
  }
}

double elastic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                      std::span<const Eigen::Quaterniond> rotations) {
  double energy = 0;
  for (int t = 0; t < model.tet_count(); ++t) {
    const auto i = static_cast<std::size_t>(t);
    const TetRest& rest = model.tets[i];
    const Eigen::Matrix3d m = rotations[i].toRotationMatrix().transpose() * deformation_gradient(model, positions, t);
    const Eigen::Matrix3d strain = 0.5 * (m + m.transpose()) - Eigen::Matrix3d::Identity();
    energy += rest.volume * (rest.mu * strain.squaredNorm() + 0.5 * rest.lambda * strain.trace() * strain.trace());
  }
  return energy;
}

Eigen::Quaterniond node_rotation(const TissueModel& model, int node, std::span<const Eigen::Quaterniond> from,
                                 std::span<const Eigen::Quaterniond> to) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  const auto n = static_cast<std::size_t>(node);
  for (int k = model.incident_start[n]; k < model.incident_start[n + 1]; ++k) {
    const auto t = static_cast<std::size_t>(model.incident_tets[static_cast<std::size_t>(k)]);
    const Eigen::Vector4d q = (to[t] * from[t].conjugate()).coeffs();
    sum += (q.w() < 0 ? -1.0 : 1.0) * model.tets[t].volume * q;  // q and -q are one rotation; these are small ones
  }
  if (!(sum.squaredNorm() > 0)) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(sum).normalized();
}

}  // namespace stylet::physics
