// A box of Kuhn tetrahedra: six to a cell, the mesh of the reference experiments.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>

#include <array>
#include <functional>
#include <vector>

namespace stylet::reference {

/// Regular box from `low` to `high` with `cells` cells along each axis; node (i, j, k) has index
/// i + (cells.x + 1) * (j + (cells.y + 1) * k). Its neighbouring cells fit: every diagonal runs from low to high.
physics::TetMesh kuhn_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const std::array<int, 3>& cells);

/// Nodes for which `where(rest position)` holds, ascending.
std::vector<int> nodes_where(const physics::TetMesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& where);

/// Moves every node strictly inside the bounding box by up to `amount` along each axis (seeded, reproducible): an
/// irregular mesh of the same box.
void jitter_inner_nodes(physics::TetMesh& mesh, double amount, unsigned seed);

}  // namespace stylet::reference
