// Makes the boundary of a tetrahedral mesh a two-manifold by leaving out tetrahedra.
#pragma once

#include "engine/files/pulse.h"
#include "physics/tissue/tet_mesh.h"

namespace stylet::mesh {

/// Of the parts of a mesh that are connected through faces.
enum class Parts {
  largest,  ///< by volume
  all,
};

/// Keeps the largest part, or all, and takes away tetrahedra where the boundary touches itself in an edge or a
/// vertex: of the fans of tetrahedra that meet there only the largest stays. Nodes no longer used are dropped; the
/// order of what stays is kept.
/// @param pulse  called often meanwhile; may throw to end it
void keep_manifold_part(physics::TetMesh& mesh, Parts parts = Parts::largest, const files::Pulse& pulse = {});

}  // namespace stylet::mesh
