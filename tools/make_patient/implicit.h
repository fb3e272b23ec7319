// Building blocks of implicit solids: functions that are negative inside, positive outside, and about the distance in
// metres near the surface. After I. Quilez, "Distance functions" and "Smooth minimum".
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace stylet::patient {

using Vector3 = Eigen::Vector3d;

constexpr double operator""_mm(long double length) {
  return static_cast<double>(length) * 1e-3;
}
inline Vector3 mm(double x, double y, double z) {
  return Vector3(x, y, z) * 1e-3;
}
constexpr double radians(double degrees) {
  return degrees * 3.14159265358979323846 / 180;
}

/// Union whose crease is rounded over a width `blend`, m. Polynomial, C1.
inline double smooth_min(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0) / blend;
  return std::min(a, b) - h * h * blend / 4;
}
/// Intersection with a rounded edge.
inline double smooth_max(double a, double b, double blend) {
  return -smooth_min(-a, -b, blend);
}
/// `solid` without `hole`.
inline double smooth_cut(double solid, double hole, double blend) {
  return smooth_max(solid, -hole, blend);
}

inline double sphere(const Vector3& x, const Vector3& centre, double radius) {
  return (x - centre).norm() - radius;
}

/// First-order distance to an axis-aligned ellipsoid.
inline double ellipsoid(const Vector3& x, const Vector3& centre, const Vector3& semi_axes) {
  const Vector3 p = x - centre;
  const double k0 = p.cwiseQuotient(semi_axes).norm();
  const double k1 = p.cwiseQuotient(semi_axes.cwiseProduct(semi_axes)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -semi_axes.minCoeff();
}

/// The convex hull of two spheres, exactly where the axis is longer than the difference of the radii, first order
/// elsewhere.
inline double round_cone(const Vector3& x, const Vector3& a, const Vector3& b, double radius_a, double radius_b) {
  const Vector3 axis = b - a;
  const double length2 = axis.squaredNorm();
  const double t = length2 > 0 ? std::clamp((x - a).dot(axis) / length2, 0.0, 1.0) : 0.0;
  return (x - a - t * axis).norm() - (radius_a + t * (radius_b - radius_a));
}

inline double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Slow, shallow waves that take the mathematical look off a shape: displacement of x, at most about 1.5 amplitudes.
inline Vector3 waves(const Vector3& x, double amplitude, double wavelength) {
  const Vector3 p = x * (6.283185307179586 / wavelength);
  return amplitude * Vector3(std::sin(p.y() + 0.7 * p.z() + 0.3), std::sin(0.9 * p.z() + 0.5 * p.x() + 1.9),
                             std::sin(1.1 * p.x() + 0.6 * p.y() + 4.1));
}

}  // namespace stylet::patient
