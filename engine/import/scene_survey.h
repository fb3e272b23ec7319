// What lies where in an imported scene: organs that overlap, and what a straight needle would pass.
#pragma once

#include "engine/import/scene_import.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::import {

/// Pairs of organs that claim the same place, counted in voxels, largest first. What a body carries, and the parts of
/// one body, lie in each other on purpose: not counted.
std::vector<Overlap> find_overlaps(std::span<const gltf::AnnotatedSurface> surfaces);

/// What the line from entry to target passes, in the order of the path.
std::vector<PathPiece> find_path(std::span<const gltf::AnnotatedSurface> surfaces, const Eigen::Vector3d& entry,
                                 const Eigen::Vector3d& target);

/// Centre of the volume inside a closed surface.
Eigen::Vector3d centre_of(const mesh::TriangleMesh& surface);

}  // namespace stylet::import
