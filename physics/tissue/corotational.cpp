#include "physics/tissue/corotational.h"

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/inversion.h"
#include "physics/tissue/quadratic.h"

#include <Eigen/LU>

#include <array>

namespace stylet::physics {
namespace {

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

}  // namespace

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
  if (model.is_quadratic()) return update_quadratic_rotations(model, positions, rotations);
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
  if (model.is_quadratic()) {
    return quadratic_forces(model, positions, rotations, forces, rest_size, !with_barrier);
  }
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
  if (model.is_quadratic()) return quadratic_energy(model, positions, rotations, rest_size);
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
