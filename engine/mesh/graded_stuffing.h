// Tetrahedra that get smaller towards a point.
#pragma once

#include "engine/mesh/stuffing.h"

namespace stylet::mesh {

struct Grading {
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< in the solid, m
  double factor = 2;  ///< by which tetrahedra at the target are shorter than elsewhere, 1 to 4
};

/// As stuff() with Parts::largest, but the lattice is drawn together towards the target within a ball, by a smooth
/// map of space that leaves the ball's rim and all beyond as they are. The ball reaches to the surface, so that cells
/// there stay uniform, or four cells where the surface is closer. Midway to its rim cells are up to 1.5 times longer
/// in the direction of the target than across.
/// @param distance  negative at the target
physics::TetMesh stuff_graded(const SignedDistance& distance, const Eigen::AlignedBox3d& box, double cell,
                              int smoothing, const Grading& grading);

}  // namespace stylet::mesh
