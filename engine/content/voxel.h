// Where a point is in the label volume.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstddef>

namespace stylet::content {

/// Index of the voxel around a point, -1: none.
inline std::ptrdiff_t voxel_at(const LabelVolume& volume, const Eigen::Vector3d& x) {
  const Eigen::Array3d at = ((x - volume.origin.cast<double>()) / volume.spacing).array().round();
  if (!(at >= 0).all() || !(at < volume.size.array().cast<double>()).all()) return -1;
  const auto i = at.cast<std::ptrdiff_t>().eval();
  return (i[2] * volume.size.y() + i[1]) * volume.size.x() + i[0];
}

}  // namespace stylet::content
