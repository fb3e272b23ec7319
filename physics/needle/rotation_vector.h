// Finite rotations as rotation vectors: exponential, logarithm and their differentials.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>

namespace stylet::physics {

/// S(v): S(v) w = v x w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d s;
  s << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return s;
}

/// Unit quaternion of the rotation vector `w` (rad).
inline Eigen::Quaterniond exponential(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const double half = 0.5 * angle;
  // sin(t/2)/t by its series where the quotient loses digits
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(half) / angle;
  return Eigen::Quaterniond(std::cos(half), scale * w.x(), scale * w.y(), scale * w.z());
}

/// Rotation vector of a unit quaternion, |w| <= pi.
inline Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double s = v.norm();
  const double c = sign * q.w();
  if (s < 1e-6) return 2.0 / c * (1.0 - s * s / (3.0 * c * c)) * v;  // atan(s/c)/s
  return 2.0 * std::atan2(s, c) / s * v;
}

/// Coefficients of the inverse differential of the exponential, T^-1(w) = I - S(w)/2 + eta S(w)^2, and of its change:
/// eta = (1 - (t/2) cot(t/2)) / t^2, mu = (d eta / dt) / t, with t = |w| < 2 pi.
struct InverseTangentCoefficients {
  double eta, mu;
  explicit InverseTangentCoefficients(double t) {
    const double t2 = t * t;
    if (t < 0.5) {  // series of the cotangent: the quotients cancel here
      eta = 1.0 / 12 + t2 * (1.0 / 720 + t2 * (1.0 / 30240 + t2 * (1.0 / 1209600 + t2 * (1.0 / 47900160))));
      mu = 1.0 / 360 + t2 * (1.0 / 7560 + t2 * (1.0 / 201600 + t2 * (1.0 / 5987520)));
    } else {
      const double half_sine = std::sin(0.5 * t);
      eta = (1.0 - 0.5 * t / std::tan(0.5 * t)) / t2;
      mu = (t * (t + std::sin(t)) - 8.0 * half_sine * half_sine) / (4.0 * t2 * t2 * half_sine * half_sine);
    }
  }
};

/// T^-1(w): change of the rotation vector w of R for a spin s applied from the left, R <- exp(s) R: dw = T^-1 s.
inline Eigen::Matrix3d inverse_tangent(const Eigen::Vector3d& w) {
  const InverseTangentCoefficients k(w.norm());
  const Eigen::Matrix3d s = skew(w);
  return Eigen::Matrix3d::Identity() - 0.5 * s + k.eta * s * s;
}

/// d(T^-T(w) m)/dw for a constant m.
inline Eigen::Matrix3d inverse_tangent_transpose_derivative(const Eigen::Vector3d& w, const Eigen::Vector3d& m) {
  const InverseTangentCoefficients k(w.norm());
  const Eigen::Matrix3d s = skew(w);
  const Eigen::Matrix3d wm = w * m.transpose();
  return k.eta * (wm - 2.0 * wm.transpose() + w.dot(m) * Eigen::Matrix3d::Identity()) +
         k.mu * s * s * (m * w.transpose()) - 0.5 * skew(m);
}

}  // namespace stylet::physics
