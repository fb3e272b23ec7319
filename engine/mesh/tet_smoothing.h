// Moves nodes of a tetrahedral mesh so that its worst angles get better.
#pragma once

#include "engine/mesh/stuffing.h"
#include "physics/tissue/tet_mesh.h"

namespace stylet::mesh {

/// Optimisation-based smoothing after L. Freitag and C. Ollivier-Gooch, "Tetrahedral mesh improvement using swapping
/// and smoothing" (1997): nodes whose worst dihedral angle is poor are moved, one after the other, towards the
/// centroid of their neighbours or in a pattern search; a move is kept only if the smallest sine of the dihedral
/// angles around the node grows. Boundary nodes move along the isosurface distance = 0. Never inverts a tetrahedron.
/// @param cell    sets the length of the moves, m
/// @param passes  over all nodes
void smooth(physics::TetMesh& mesh, const SignedDistance& distance, double cell, int passes);

}  // namespace stylet::mesh
