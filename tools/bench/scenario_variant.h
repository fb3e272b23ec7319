// A shipped scenario with other tetrahedra, or other tissues.
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

/// The scenario with keys of its tissues replaced.
/// @param tissues  JSON merge patch (RFC 7396) of the file of its tissues
/// @throws files::ContentError  it cannot be read
content::Scene scenario_with_tissues(const std::string& name, const std::string& tissues);

}  // namespace stylet::bench
