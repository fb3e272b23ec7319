// What tissue is made of.
#pragma once

namespace stylet::physics {

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
