#include "physics/tissue/closest_rotation.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace stylet::physics {
namespace {

constexpr int kMaxNewtonIterations = 8;
// The step after it is below 4e-15: Newton's error is 0.5 w^3 here, since what C and g have of second order in the
// angle cancels (strains up to 0.8, measured; 5 w^3 where one axis is stretched 25 times as far as another).
constexpr double kSmallStep = 2e-5;

Eigen::Quaterniond rotation_by_svd(const Eigen::Matrix3d& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3d, Eigen::NoQRPreconditioner> svd(f,
                                                                         Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) = -u.col(2);
  return Eigen::Quaterniond(Eigen::Matrix3d(u * svd.matrixV().transpose())).normalized();
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

Lanes determinant(const LaneMatrix& f) {
  return f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
         f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
}

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

}  // namespace stylet::physics
