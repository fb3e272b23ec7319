// The surface between what is above a threshold and what is below it.
#pragma once

#include "engine/mesh/triangle_mesh.h"
#include "engine/procedures/ablation/bioheat.h"

#include <span>

namespace stylet::procedures::ablation {

/// Surface of {x : values(x) > level} of a field given at the cells' centres, linear between them: marching
/// tetrahedra on the six Kuhn tetrahedra of each cube of cells (Doi and Koide 1991), which fit together, so that the
/// surface is closed, manifold and outward wherever the border of the grid lies below the level.
/// @param values  [grid.count()]
mesh::TriangleMesh iso_surface(const CellGrid& grid, std::span<const double> values, double level);

}  // namespace stylet::procedures::ablation
