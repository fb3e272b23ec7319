// Closed surfaces become a volume of tissue labels.
#pragma once

#include "engine/content/scene.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace stylet::readers {

/// Most bytes of labels and bodies together (distances to surfaces are half as many more); the spacing grows until
/// they fit.
inline constexpr std::size_t kLabelBytes = 64u << 20;

/// A closed surface to be filled.
struct LabelledSolid {
  const mesh::TriangleMesh* surface = nullptr;
  std::uint8_t label = 0;
  std::int8_t body = -1;
};

/// What lies between the organs, behind a wall.
struct LabelFiller {
  std::uint8_t label = 0;
  std::vector<std::size_t> wall;  ///< indices of the solids that are the wall
  int axis = 2;                   ///< the wall lies in front of the filler along this axis,
  bool positive = true;           ///< in its positive or negative direction
};

/// Whether a volume knows how far its voxels lie from the surfaces between tissues (LabelVolume::edges).
enum class LabelEdges : std::uint8_t { none, measured };

/// Volume over the bounds of all solids. Where solids overlap, the one listed last wins: list outer ones first.
/// Voxels in no solid get the filler where the wall is in front of them, else label 0.
/// Deterministic; linear in triangles and voxels (parity along rows of x).
content::LabelVolume voxelise(std::span<const LabelledSolid> solids, double spacing,
                              const std::optional<LabelFiller>& filler, LabelEdges edges = LabelEdges::none);

/// Crossings of a closed surface with the rows of voxel centres of a volume, by row (k * size.y + j) then x. A row
/// crosses a closed surface an even number of times.
struct RowCrossing {
  std::uint32_t row = 0;
  float x = 0;  ///< m
};
std::vector<RowCrossing> row_crossings(const mesh::TriangleMesh& surface, const content::LabelVolume& volume);

}  // namespace stylet::readers
