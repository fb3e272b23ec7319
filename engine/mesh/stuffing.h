// Tetrahedra from a signed distance: isosurface stuffing.
//
// F. Labelle, J. R. Shewchuk, "Isosurface stuffing: fast tetrahedral meshes with good dihedral angles", SIGGRAPH
// 2007. A body-centred cubic lattice is cut by the surface; lattice points too close to it are moved onto it
// (warping), the tetrahedra that remain crossed are cut by stencils. Then, beyond the paper: pinches of the boundary
// are removed and nodes are smoothed so that the worst dihedral angle rises.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/tet_manifold.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <functional>

namespace stylet::mesh {

/// Metres, negative inside, positive outside, Lipschitz constant about 1 near the surface, below 2 everywhere.
using SignedDistance = std::function<double(const Eigen::Vector3d&)>;

/// Tetrahedra of {x : distance(x) < 0}, of its largest connected part unless all are asked for.
/// @param box            contains the solid
/// @param cell           edge of the lattice's cubic cell, m; inner nodes are sqrt(3)/2 cell apart. Features thinner
///                       than a cell may vanish
/// @param smoothing      passes of quality smoothing
/// @param pulse          called often meanwhile; may throw to end it
/// @return positively oriented tetrahedra with a two-manifold boundary, no unused nodes; empty where the solid is
///         smaller than the lattice resolves. The same input gives the same bits.
physics::TetMesh stuff(const SignedDistance& distance, const Eigen::AlignedBox3d& box, double cell, int smoothing = 6,
                       Parts parts = Parts::largest, const files::Pulse& pulse = {});

}  // namespace stylet::mesh
