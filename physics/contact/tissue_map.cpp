#include "physics/contact/tissue_map.h"

#include <algorithm>

namespace stylet::physics {

Eigen::Vector3i TissueMap::voxel_at(const Eigen::Vector3d& x) const {
  return ((x - origin) / spacing).array().round().cast<int>();
}

int TissueMap::label(const Eigen::Vector3i& v) const {
  if ((v.array() < 0).any() || (v.array() >= size.array()).any()) return 0;
  const Eigen::Index index = (Eigen::Index{v.z()} * size.y() + v.y()) * size.x() + v.x();
  return labels[index];
}

int TissueMap::at(const Eigen::Vector3d& rest, int inside) const {
  if (labels.empty()) return 1;
  const auto soft = [&](const Eigen::Vector3i& voxel) {
    const int found = label(voxel);
    return resistance(found).rigid ? 0 : found;
  };
  const Eigen::Vector3i voxel = voxel_at(rest);
  if (const int here = soft(voxel); here != 0) return here;
  for (int distance = 1; distance <= 2; ++distance) {  // the mesh's surface is not the voxels'
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const int near = soft(voxel + sign * distance * Eigen::Vector3i::Unit(axis));
        if (near != 0) return near;
      }
    }
  }
  return inside;
}

double TissueMap::modulus_at(const Eigen::Vector3d& x) const {
  const Eigen::Vector3d at = (x - origin) / spacing;
  const Eigen::Vector3d low = at.array().floor();
  const Eigen::Vector3d beyond = at - low;
  double sum = 0;
  double known = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i step{corner & 1, corner >> 1 & 1, corner >> 2};
    const int found = label(low.cast<int>() + step);
    if (found == 0 || resistance(found).rigid) continue;
    double weight = 1;
    for (int d = 0; d < 3; ++d) weight *= step[d] == 1 ? beyond[d] : 1 - beyond[d];
    known += weight;
    sum += weight * young_modulus[static_cast<std::size_t>(found)];
  }
  return known > 0 ? sum / known : 0;
}

double TissueMap::modulus_along(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int steps) const {
  if (labels.empty() || young_modulus.empty()) return 0;
  double sum = 0;
  int known = 0;
  for (int k = 0; k < steps; ++k) {
    const double modulus = modulus_at(from + (k + 0.5) / steps * (to - from));
    sum += modulus;
    if (modulus > 0) ++known;
  }
  return known > 0 ? sum / known : 0;
}

int TissueMap::bone_at(const Eigen::Vector3d& x) const {
  const int found = labels.empty() ? 0 : label(voxel_at(x));
  return resistance(found).rigid ? found : 0;
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
