// Organs to a binary glTF file.
#pragma once

#include "engine/content/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace stylet::patient {

/// One node of the file. Later nodes lie inside or in front of earlier ones: where two overlap, the later one counts.
struct Organ {
  std::string name;            ///< of the node, the mesh and organ.id
  std::string role;            ///< boundary, region, vessel, target, visual
  std::string tissue;          ///< key of content/tissues.json
  std::string body;            ///< deformable body that carries it; empty: rigid
  content::TriangleMesh mesh;  ///< closed, outward, patient frame, m
};

using Colours = std::map<std::string, std::array<float, 4>>;  ///< of tissues, linear RGB and opacity

/// glTF 2.0 binary: one node, mesh and material an organ; positions in metres as floats, rounded to a micrometre;
/// extras.organ on nodes, extras.tissue on materials. The same organs give the same bytes.
std::vector<std::byte> write_glb(const std::vector<Organ>& organs, const Colours& colours,
                                 const std::string& copyright);

}  // namespace stylet::patient
