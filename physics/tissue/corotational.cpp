#include "physics/tissue/corotational.h"

#include "physics/tissue/inversion.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <array>

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

// Four tetrahedra side by side: this runs for every tetrahedron at every step.
constexpr int kLanes = 4;
using Lanes = Eigen::Array4d;
using LaneMatrix = std::array<std::array<Lanes, 3>, 3>;  // [row][column]

/// Deformation gradients of tetrahedra first .. first + 3.
LaneMatrix deformation_gradients(const TissueModel& model, const Eigen::Matrix3Xd& positions, int first) {
  LaneMatrix edges;      // [axis][edge]
  LaneMatrix gradients;  // [axis][edge]
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto t = static_cast<std::size_t>(first + lane);
    const auto& n = model.mesh.tets[t];
    const TetRest& rest = model.tets[t];
    for (std::size_t e = 0; e < 3; ++e) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        edges[axis][e][lane] = positions(i, n[e + 1]) - positions(i, n[0]);
        gradients[axis][e][lane] = rest.gradients(i, static_cast<Eigen::Index>(e) + 1);
      }
    }
  }
  LaneMatrix f;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      f[i][j] = edges[i][0] * gradients[j][0] + edges[i][1] * gradients[j][1] + edges[i][2] * gradients[j][2];
    }
  }
  return f;
}

Lanes determinant(const LaneMatrix& f) {
  return f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
         f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
}

/// closest_rotation() in lanes, without its SVD: false if any lane is not near a maximum or did not converge, q is
/// then of no use.
/// @param[in,out] q  x, y, z, w
bool closest_rotations(const LaneMatrix& f, std::array<Lanes, 4>& q) {
  for (int iteration = 0; iteration < kMaxNewtonIterations; ++iteration) {
    const auto& [x, y, z, w] = q;
    const LaneMatrix r{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                        {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                        {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
    LaneMatrix m;  // R^T F
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) m[i][j] = r[0][i] * f[0][j] + r[1][i] * f[1][j] + r[2][i] * f[2][j];
    }
    const Lanes g0 = m[2][1] - m[1][2];
    const Lanes g1 = m[0][2] - m[2][0];
    const Lanes g2 = m[1][0] - m[0][1];
    const Lanes c00 = m[1][1] + m[2][2];
    const Lanes c11 = m[0][0] + m[2][2];
    const Lanes c22 = m[0][0] + m[1][1];
    const Lanes c01 = -0.5 * (m[0][1] + m[1][0]);
    const Lanes c02 = -0.5 * (m[0][2] + m[2][0]);
    const Lanes c12 = -0.5 * (m[1][2] + m[2][1]);
    const Lanes k00 = c11 * c22 - c12 * c12;
    const Lanes k01 = c02 * c12 - c01 * c22;
    const Lanes k02 = c01 * c12 - c02 * c11;
    const Lanes k11 = c00 * c22 - c02 * c02;
    const Lanes k12 = c01 * c02 - c00 * c12;
    const Lanes minor = c00 * c11 - c01 * c01;
    const Lanes determinant = c00 * k00 + c01 * k01 + c02 * k02;
    if (!(c00 > 0 && minor > 0 && determinant > 0).all()) return false;
    const Lanes half = 0.5 / determinant;
    const Lanes h0 = half * (k00 * g0 + k01 * g1 + k02 * g2);
    const Lanes h1 = half * (k01 * g0 + k11 * g1 + k12 * g2);
    const Lanes h2 = half * (k02 * g0 + k12 * g1 + minor * g2);
    const Lanes turn = h0 * h0 + h1 * h1 + h2 * h2;          // |w/2|^2
    std::array<Lanes, 4> next{x + w * h0 + y * h2 - z * h1,  // q (1, w/2)
                              y + w * h1 + z * h0 - x * h2,  //
                              z + w * h2 + x * h1 - y * h0,  //
                              w - x * h0 - y * h1 - z * h2};
    const Lanes inverse_norm =
        (next[0] * next[0] + next[1] * next[1] + next[2] * next[2] + next[3] * next[3]).sqrt().inverse();
    for (std::size_t i = 0; i < 4; ++i) q[i] = next[i] * inverse_norm;
    if ((turn < 0.25 * kSmallStep * kSmallStep).all()) return true;
  }
  return false;
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

CorotatedStress corotated_stress(const TetRest& rest, const Eigen::Matrix3d& f, const Eigen::Matrix3d& r,
                                 double rest_size) {
  const Eigen::Matrix3d m = r.transpose() * f;
  CorotatedStress result;
  result.stretch = 0.5 * (m + m.transpose());
  const Eigen::Matrix3d strain = result.stretch - rest_size * Eigen::Matrix3d::Identity();
  result.stress = 2 * rest.mu * strain;
  result.stress.diagonal().array() += rest.lambda * strain.trace();
  return result;
}

Eigen::Matrix3d deformation_gradient(const TissueModel& model, const Eigen::Matrix3Xd& positions, int tet) {
  const auto& n = model.mesh.tets[tet];
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = positions.col(n[a + 1]) - positions.col(n[0]);
  return edges * model.tets[tet].gradients.rightCols<3>().transpose();
}

namespace {

int update_rotations_one_by_one(const TissueModel& model, const Eigen::Matrix3Xd& positions, int begin, int end,
                                std::span<Eigen::Quaterniond> rotations) {
  int inverted = 0;
  for (int t = begin; t < end; ++t) {
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    if (!(f.determinant() > 0)) ++inverted;
    auto& q = rotations[t];
    q = closest_rotation(f, q);
  }
  return inverted;
}

}  // namespace

int update_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<Eigen::Quaterniond> rotations) {
  int inverted = 0;
  const int in_lanes = model.tet_count() / kLanes * kLanes;
  for (int first = 0; first < in_lanes; first += kLanes) {
    const LaneMatrix f = deformation_gradients(model, positions, first);
    std::array<Lanes, 4> q;
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto& start = rotations[first + lane].coeffs();
      for (std::size_t i = 0; i < 4; ++i) q[i][lane] = start[static_cast<Eigen::Index>(i)];
    }
    if ((determinant(f) > 0).all() && closest_rotations(f, q)) {
      for (int lane = 0; lane < kLanes; ++lane) {
        rotations[first + lane].coeffs() << q[0][lane], q[1][lane], q[2][lane], q[3][lane];
      }
    } else {
      inverted += update_rotations_one_by_one(model, positions, first, first + kLanes, rotations);
    }
  }
  return inverted + update_rotations_one_by_one(model, positions, in_lanes, model.tet_count(), rotations);
}

int internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                    std::span<const double> rest_size, bool with_barrier) {
  int squeezed = 0;
  forces.setZero();
  for (int t = 0; t < model.tet_count(); ++t) {
    const TetRest& rest = model.tets[t];
    const double size = rest_size.empty() ? 1 : rest_size[t];
    const Eigen::Matrix3d r = rotations[t].toRotationMatrix();
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    // Stress times volume, in the deformed frame.
    Eigen::Matrix3d p = rest.volume * r * corotated_stress(rest, f, r, size).stress;
    if (const double j = f.determinant(); j < kSqueezed && size == 1 && with_barrier) {
      p += rest.volume * barrier(rest, j).slope * cofactor(f);
      ++squeezed;
    }
    const auto& n = model.mesh.tets[t];
    for (int a = 0; a < 4; ++a) forces.col(n[a]) += p * rest.gradients.col(a);
  }
  return squeezed;
}

double elastic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                      std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size) {
  double energy = 0;
  for (int t = 0; t < model.tet_count(); ++t) {
    const TetRest& rest = model.tets[t];
    const Eigen::Matrix3d f = deformation_gradient(model, positions, t);
    const Eigen::Matrix3d m = rotations[t].toRotationMatrix().transpose() * f;
    const double size = rest_size.empty() ? 1 : rest_size[t];
    const Eigen::Matrix3d strain = 0.5 * (m + m.transpose()) - size * Eigen::Matrix3d::Identity();
    energy += rest.volume * (rest.mu * strain.squaredNorm() + 0.5 * rest.lambda * strain.trace() * strain.trace());
    if (size == 1) energy += rest.volume * barrier(rest, f.determinant()).energy;
  }
  return energy;
}

}  // namespace stylet::physics
