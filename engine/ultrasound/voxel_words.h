// The anatomy in rest space as the passes look it up: one word a voxel; beyond the volume that of its border.
#pragma once

#include "engine/content/scene.h"

#include <cstdint>
#include <vector>

namespace stylet::ultrasound {

/// label | (owner + 1) << 8 | clearance << 11, in the order of content::LabelVolume, padded to an even number.
///   owner      body whose tetrahedra carry the voxel; -1: none does; the number of bodies: it goes with the breath
/// Walls that are thinner than the surfaces (Scene::tissue_walls) are put in; where the patient ends flat, it was
/// cut, and anatomy goes on to the volume's border and, for who looks it up, beyond.
///   clearance  all voxels nearer than this along every axis have the same label and owner; 1..31
std::vector<std::uint16_t> voxel_words(const content::Scene& scene);

inline int label_of(std::uint32_t word) {
  return static_cast<int>(word & 0xFFU);
}
inline int owner_of(std::uint32_t word) {
  return static_cast<int>(word >> 8U & 7U) - 1;
}

}  // namespace stylet::ultrasound
