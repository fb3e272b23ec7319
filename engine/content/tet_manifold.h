// Makes the boundary of a tetrahedral mesh a two-manifold by leaving out tetrahedra.
#pragma once

#include "physics/tissue/tet_mesh.h"

namespace stylet::content {

/// Keeps the largest (by volume) part connected through faces and takes away tetrahedra where the boundary touches
/// itself in an edge or a vertex: of the fans of tetrahedra that meet there only the largest stays. Nodes no longer
/// used are dropped; the order of what stays is kept.
void keep_manifold_part(physics::TetMesh& mesh);

}  // namespace stylet::content
