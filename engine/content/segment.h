// How far a point is from a straight piece of needle.
#pragma once

#include <Eigen/Core>

#include <algorithm>

namespace stylet::content {

/// Of a point from the segment a b, m.
inline double distance_to_segment(const Eigen::Vector3d& x, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d axis = b - a;
  const double squared = axis.squaredNorm();
  const double t = squared > 0 ? std::clamp((x - a).dot(axis) / squared, 0.0, 1.0) : 0.0;
  return (x - a - t * axis).norm();
}

}  // namespace stylet::content
