// Limits of vectors by their norm: the direction is kept.
#pragma once

#include <Eigen/Core>

namespace stylet::haptic {

/// Scales `v`, finite, to norm `max` if it is longer; true if it was. Divides by the largest component first: the
/// norm of a finite vector may overflow.
inline bool clamp_norm(Eigen::Vector3d& v, double max) {
  const double largest = v.cwiseAbs().maxCoeff();
  if (largest == 0) return false;
  const Eigen::Vector3d unit_box = v / largest;
  const double scale = max / unit_box.norm();  // of the vector with its largest component 1
  if (largest <= scale) return false;
  v = unit_box * scale;
  return true;
}

/// Lets `wanted` be no further than `max_change` from `last`; true if it was. Where both lie in a ball, the result
/// does too.
inline bool limit_change(Eigen::Vector3d& wanted, const Eigen::Vector3d& last, double max_change) {
  Eigen::Vector3d change = wanted - last;
  if (!clamp_norm(change, max_change)) return false;
  wanted = last + change;
  return true;
}

}  // namespace stylet::haptic
