// A solid becomes a simulation mesh.
#pragma once

#include "engine/content/stuffing.h"
#include "engine/content/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Geometry>

#include <string>

namespace stylet::content {

/// What is to be filled, however it is known.
struct SolidShape {
  SignedDistance distance;
  Eigen::AlignedBox3d box;  ///< contains it
  double volume = 0;        ///< m^3
};

struct TetrahedraliseSettings {
  double cell = 0;                ///< edge of the lattice cell, m; 0: found for what follows
  int target_nodes = 2300;        ///< wanted where cell is 0; 0: volume_error counts
  double volume_error = 0.03;     ///< most that is accepted where cell and target_nodes are 0, relative
  double node_tolerance = 0.06;   ///< relative; the search stops within it
  double min_dihedral_deg = 12;   ///< below it the mesh is refused
  std::string where = "surface";  ///< named in errors: file and node
};

/// Isosurface stuffing (stuffing.h) of a solid.
/// @throws ContentError  no tetrahedron at this cell size; worse than min_dihedral_deg
physics::TetMesh tetrahedralise(const SolidShape& solid, const TetrahedraliseSettings& settings);

/// The same of the solid inside `surface`, which is first cleaned and demanded to be solid (surface_mesh.h).
/// @throws ContentError  also: no solid
physics::TetMesh tetrahedralise(const TriangleMesh& surface, const TetrahedraliseSettings& settings);

}  // namespace stylet::content
