// The anatomy in rest space as the passes look it up: one word a voxel; beyond the volume that of its border.
#pragma once

#include "engine/content/scene.h"
#include "shaders/ultrasound_shared.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace stylet::ultrasound {

/// label | (owner + 1) << 8 | edge << 11, in the order of content::LabelVolume, padded to an even number.
///   owner      body whose tetrahedra carry the voxel; -1: none does; the number of bodies: it goes with the breath
/// Walls that are thinner than the surfaces (Scene::tissue_walls) are put in; where the patient ends flat, it was
/// cut, and anatomy goes on to the volume's border and, for who looks it up, beyond.
///   edge       below kEdges: a voxel beside differs, and the surface between lies (edge + 1) / kEdgesPerVoxel voxels
///              from this one's centre; else all voxels nearer than edge + 2 - kEdges along every axis have the same
///              label and owner
std::vector<std::uint16_t> voxel_words(const content::Scene& scene);

inline int label_of(std::uint32_t word) {
  return static_cast<int>(word & 0xFFU);
}
inline int owner_of(std::uint32_t word) {
  return static_cast<int>(word >> 8U & 7U) - 1;
}
/// All voxels nearer than this, along every axis, are as this one.
inline int clearance_of(std::uint32_t word) {
  return std::max(static_cast<int>(word >> 11U) + 2 - kEdges, 1);
}
/// Of a voxel beside one that differs: from its centre to the surface between them, voxels.
inline float edge_of(std::uint32_t word) {
  return static_cast<float>((word >> 11U) + 1) / kEdgesPerVoxel;
}

}  // namespace stylet::ultrasound
