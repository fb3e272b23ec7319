// Tetrahedra of ten nodes for a solid: the middles of the edges on its boundary lie on its surface.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/stuffing.h"
#include "physics/tissue/tet_mesh.h"

namespace stylet::mesh {

/// Each tetrahedron in eight (physics/tissue/refinement.h), which are one quadratic element; then the middles of the
/// edges on the boundary go to the isosurface distance = 0, as far as the elements around them stay well shaped: of
/// none of its eight the smallest dihedral angle falls below 14 degrees (or what it was), and where strain is
/// measured the volume stays above half of its mean.
/// @param coarse  positively oriented
/// @param pulse   called often meanwhile; may throw to end it
physics::TetMesh refined_on_surface(const physics::TetMesh& coarse, const SignedDistance& distance,
                                    const files::Pulse& pulse = {});

}  // namespace stylet::mesh
