// A tetrahedral mesh: the rest geometry of a deformable body.
#pragma once

#include <Eigen/Core>

#include <array>
#include <vector>

namespace stylet::physics {

/// Rest geometry, patient frame, metres. Tetrahedra are positively oriented:
/// det[x1-x0, x2-x0, x3-x0] > 0.
struct TetMesh {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<std::array<int, 4>> tets;
};

/// Mechanical material of a tetrahedron (physics/README.md eq. 2).
struct ElasticMaterial {
  double young_modulus = 5000.0;  ///< E, Pa
  double poisson_ratio = 0.45;    ///< nu, -
};

/// What a mesh is like around a node: means over its tetrahedra. Interpolated between nodes they are continuous,
/// which the values of tetrahedra are not.
struct NodeSurroundings {
  double tet_volume = 0;       ///< at rest, m^3
  ElasticMaterial material{};  ///< by volume, as the stiffness of the node is made
};

}  // namespace stylet::physics
