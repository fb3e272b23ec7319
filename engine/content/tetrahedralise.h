// A closed surface becomes a simulation mesh.
#pragma once

#include "engine/content/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <string>

namespace stylet::content {

struct TetrahedraliseSettings {
  double cell = 0;                ///< edge of the lattice cell, m; 0: found for target_nodes
  int target_nodes = 2300;        ///< wanted where cell is 0
  double node_tolerance = 0.06;   ///< relative; the search stops within it
  double min_dihedral_deg = 12;   ///< below it the mesh is refused
  std::string where = "surface";  ///< named in errors: file and node
};

/// Isosurface stuffing (stuffing.h) of the solid inside `surface`, which is first cleaned and demanded to be solid
/// (surface_mesh.h).
/// @throws ContentError  no solid; no tetrahedron at this cell size; worse than min_dihedral_deg
physics::TetMesh tetrahedralise(const TriangleMesh& surface, const TetrahedraliseSettings& settings);

}  // namespace stylet::content
