// What tissue is made of.
#pragma once

#include <array>
#include <cstddef>

namespace stylet::physics {

/// A part of the shear stress that fades while the strain stays (physics/README.md eq. 46).
struct Relaxation {
  double share = 0;   ///< of the shear modulus, -
  double time_s = 1;  ///< to 1/e
};

/// Parallel layers thinner than the mesh, soft ones between stiff ones (physics/README.md eq. 51).
struct Layering {
  double across = 1;               ///< E across them, the harmonic mean, over E along them, the mean; -
  std::array<double, 3> normal{};  ///< unit, at rest; zero: unknown, what differs is taken for one of the mean
};

/// Mechanical material of a tetrahedron (physics/README.md eq. 2, 45).
struct ElasticMaterial {
  double young_modulus = 5000.0;           ///< E, Pa; at once, and at small strain
  double poisson_ratio = 0.45;             ///< nu, -
  double stiffening = 0;                   ///< b of eq. 45, -
  std::array<Relaxation, 2> relaxation{};  ///< shares together below 1
  Layering layers{};                       ///< quadratic elements only
};

/// Adds a part of a material to a mean; what fades does so at the mean rate. Layers are left out.
inline void add_part(ElasticMaterial& mean, const ElasticMaterial& material, double weight) {
  mean.young_modulus += weight * material.young_modulus;
  mean.poisson_ratio += weight * material.poisson_ratio;
  mean.stiffening += weight * material.stiffening;
  for (std::size_t i = 0; i < mean.relaxation.size(); ++i) {
    Relaxation& term = mean.relaxation[i];
    const double part = weight * material.relaxation[i].share;
    const double rate = term.share / term.time_s + part / material.relaxation[i].time_s;
    term.share += part;
    if (rate > 0) term.time_s = term.share / rate;
  }
}

/// What a mesh is like around a node: means over its tetrahedra. Interpolated between nodes they are continuous,
/// which the values of tetrahedra are not.
struct NodeSurroundings {
  double tet_volume = 0;       ///< at rest, m^3
  ElasticMaterial material{};  ///< by volume, as the stiffness of the node is made
  double strained = 1;         ///< how much stiffer than at rest strain has made it (eq. 47); E above is with it
  double capsule = 0;          ///< modulus times thickness of the membrane over the body, N/m
};

}  // namespace stylet::physics
