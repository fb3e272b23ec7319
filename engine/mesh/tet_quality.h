// How good a tetrahedral mesh is, and its boundary.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <vector>

namespace stylet::mesh {

struct TetQuality {
  double min_dihedral_deg = 180;  ///< over all tetrahedra and their six edges
  double max_dihedral_deg = 0;
  int inverted = 0;   ///< tetrahedra with volume <= 0
  double volume = 0;  ///< m^3, sum of signed volumes
};

TetQuality tet_quality(const physics::TetMesh& mesh);

/// Smallest and largest of the six dihedral angles of one tetrahedron, rad. An inverted one has min <= 0.
struct DihedralRange {
  double min = 0;
  double max = 0;
};
DihedralRange dihedral_range(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                             const Eigen::Vector3d& d);

/// The faces of one tetrahedron only, counter-clockwise from outside.
struct BoundarySurface {
  TriangleMesh mesh;
  std::vector<int> nodes;  ///< [vertices] node of the tetrahedral mesh, ascending
};
/// @param pulse  called often meanwhile; may throw to end it
BoundarySurface boundary_surface(const physics::TetMesh& mesh, const files::Pulse& pulse = {});

}  // namespace stylet::mesh
