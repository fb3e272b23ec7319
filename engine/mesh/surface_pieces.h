// A surface as the pieces it consists of.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <optional>
#include <vector>

namespace stylet::mesh {

/// The parts of a surface that are connected through shared vertices, in the order of their first triangles.
/// @param pulse  of this and the other: called often meanwhile; may throw to end it
std::vector<TriangleMesh> connected_pieces(const TriangleMesh& surface, const files::Pulse& pulse = {});

/// Pieces of a solid that a closed surface bounds.
struct OuterPieces {
  std::vector<TriangleMesh> pieces;  ///< none inside another
  int inner = 0;                     ///< left out: they lie inside another, as the inner wall of a capsule
};

/// Splits a closed surface, each piece of it outward. Absent: some pieces reach into each other, or there are more
/// than a thousand.
std::optional<OuterPieces> outer_pieces(const TriangleMesh& closed, const files::Pulse& pulse = {});

}  // namespace stylet::mesh
