// Organs to a binary glTF file, annotated as gltf.h reads it.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace stylet::gltf {

/// One node of the file. Later nodes lie inside or in front of earlier ones: where two overlap, the later one counts.
struct AnnotatedSurface {
  std::string name;         ///< of the node, the mesh and organ.id
  std::string role;         ///< boundary, region, vessel, target, visual
  std::string tissue;       ///< key of content/tissues.json; empty: the material says nothing
  std::string body;         ///< deformable body that carries it; empty: rigid
  mesh::TriangleMesh mesh;  ///< closed, outward, patient frame, m
};

/// Of tissues, linear RGB and opacity.
using TissueColours = std::map<std::string, std::array<float, 4>>;

/// What the file says of itself.
struct GlbAsset {
  std::string generator;
  std::string copyright;
  std::string scene;  ///< name
};

/// glTF 2.0 binary: one node, mesh and material an organ; positions in metres as floats, rounded to a micrometre;
/// extras.organ on nodes, extras.tissue on materials. The same organs give the same bytes.
std::vector<std::byte> write_glb(std::span<const AnnotatedSurface> organs, const TissueColours& colours,
                                 const GlbAsset& asset);

}  // namespace stylet::gltf
