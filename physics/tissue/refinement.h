// A tetrahedron of ten nodes as eight of four: what is quadratic in mechanics is linear in geometry.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <array>
#include <utility>

namespace stylet::physics {

/// Edges of a tetrahedron, in the order of the nodes 4 to 9 of a quadratic one.
inline constexpr std::array<std::pair<int, int>, 6> kTetEdges{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
/// A refined tetrahedron is so many, one after the other: at its corners 0 to 3, then four around its shortest inner
/// diagonal. Tetrahedron i at a corner has that as its node i and the middle of edge ij as its node j.
inline constexpr int kTetsOfRefined = 8;

/// Each tetrahedron in eight, by the middles of its edges. The coarse nodes keep their numbers.
TetMesh refined(const TetMesh& coarse);

}  // namespace stylet::physics
