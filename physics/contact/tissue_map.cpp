#include "physics/contact/tissue_map.h"

#include <algorithm>

namespace stylet::physics {

int TissueMap::at(const Eigen::Vector3d& rest, int inside) const {
  if (labels.empty()) return 1;
  const Eigen::Vector3i voxel = ((rest - origin) / spacing).array().round().cast<int>();
  const auto label = [&](const Eigen::Vector3i& v) {
    if ((v.array() < 0).any() || (v.array() >= size.array()).any()) return 0;
    const auto index =
        (static_cast<std::size_t>(v.z()) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(v.y())) *
            static_cast<std::size_t>(size.x()) +
        static_cast<std::size_t>(v.x());
    return static_cast<int>(labels[index]);
  };
  if (const int here = label(voxel); here != 0) return here;
  for (int distance = 1; distance <= 2; ++distance) {  // the mesh's surface is not the voxels'
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const int near = label(voxel + sign * distance * Eigen::Vector3i::Unit(axis));
        if (near != 0) return near;
      }
    }
  }
  return inside;
}

double TissueMap::puncture_force(int from, int to) const {
  for (const TissueSurface& surface : surfaces) {
    const bool same = surface.from == from && surface.to == to;
    const bool reversed = surface.from == to && surface.to == from;
    if (same || reversed) return surface.puncture_force;
  }
  if (from == 0) return resistance(to).puncture_force;
  const auto [smaller, larger] = std::minmax(resistance(from).puncture_force, resistance(to).puncture_force);
  return resistance(from).rigid || resistance(to).rigid ? larger : smaller;
}

}  // namespace stylet::physics
