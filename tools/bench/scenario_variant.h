// A shipped scenario with other tetrahedra.
#pragma once

#include "engine/content/scene.h"
#include "physics/tissue/tet_mesh.h"

#include <string>

namespace stylet::bench {

struct MeshChoice {
  physics::Element element = physics::Element::linear;
  double poisson_ratio = 0.45;  ///< of all that deforms
  double nodes = 1;             ///< times as many as the scenario asks for
  int wall_nodes = 0;           ///< of the abdominal wall, where there is one; 0: as of the others
};

/// The scenario with its bodies meshed so.
/// @throws files::ContentError  it cannot be read
content::Scene scenario_variant(const std::string& name, const MeshChoice& choice);

}  // namespace stylet::bench
