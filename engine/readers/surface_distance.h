// How far the voxels of a volume lie from a surface, where they lie close to it.
#pragma once

#include "engine/content/scene.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::readers {

/// Voxels further from a surface are as good as far: in a cell of eight that it passes through none is.
inline constexpr float kNearSurface = 1.8F;

/// Distances of voxel centres to a surface, in a box of voxels of a volume.
struct SurfaceDistance {
  Eigen::Vector3i low = Eigen::Vector3i::Zero();   ///< first voxel of the box
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< voxels of it
  std::vector<std::uint8_t> steps;  ///< content::kEdgeStep voxels; kNoEdge: further than kNearSurface. x fastest

  std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k - low.z()) * size.y() + (j - low.y())) * size.x() +
           static_cast<std::size_t>(i - low.x());
  }
};

/// Linear in the area of the surface.
SurfaceDistance surface_distance(const mesh::TriangleMesh& surface, const content::LabelVolume& volume);

}  // namespace stylet::readers
