// A tetrahedral mesh: the rest geometry of a deformable body.
#pragma once

#include "physics/messages/material.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::physics {

/// Rest geometry, patient frame, metres. Tetrahedra are positively oriented:
/// det[x1-x0, x2-x0, x3-x0] > 0.
struct TetMesh {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<std::array<int, 4>> tets;
};

/// What a displacement is made of.
enum class Element : std::uint8_t {
  linear,     ///< in each tetrahedron
  quadratic,  ///< in each eight of them that were one (refinement.h)
};

}  // namespace stylet::physics
