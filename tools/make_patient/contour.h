// An implicit solid to a triangle surface.
#pragma once

#include "engine/mesh/stuffing.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Geometry>

namespace stylet::patient {

/// Surface of {x : solid(x) < 0}, largest part only: the boundary of its isosurface stuffing, so closed, manifold,
/// and of well-shaped triangles with their corners on the surface.
/// @param cell       lattice cell, m; a triangle's edge is about 0.6 cells
/// @param triangles  reduced to about this many by quadric edge collapse (OpenMesh); 0: not reduced
mesh::TriangleMesh contour(const mesh::SignedDistance& solid, const Eigen::AlignedBox3d& box, double cell,
                           int triangles = 0);

}  // namespace stylet::patient
