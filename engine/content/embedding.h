// Surfaces ride on tetrahedra: where each vertex sits in the mesh of its body.
#pragma once

#include "engine/content/scene.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::content {

/// Embeds points in a tetrahedral mesh, both at rest. A point outside is extrapolated from the tetrahedron nearby
/// that extrapolates least (smallest largest |weight|). Deterministic; about a microsecond a point inside.
/// @return [points] weights sum to 1; largest_weight(...) tells how far the worst point was extrapolated
std::vector<Embedding> embed(std::span<const Eigen::Vector3f> points, const physics::TetMesh& mesh);

/// Largest |weight| of a set of embeddings: 1 or less where all points are inside.
float largest_weight(std::span<const Embedding> embedding);

}  // namespace stylet::content
