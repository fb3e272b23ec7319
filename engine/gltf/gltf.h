// Organs from glTF 2.0 (.glb or .gltf): every triangle node of the scene, checked, in the patient frame.
//
// tinygltf parses what concerns geometry; this reader trusts nothing it hands over. Refused with one line: files over
// the caps, JSON nested deeper than 128, files outside the asset's folder, required extensions it does not know, any
// index, view, stride or count out of bounds, cycles and shared children in the node graph, singular or non-finite
// transforms and positions. Lenient where real files need it: whatever triangles do not need is not looked at
// (normals, textures, animations, unused buffers), unknown optional extensions are skipped, points and lines are
// skipped with a warning. Where there is no scene and no node places a mesh, meshes are taken where they lie.
#pragma once

#include "engine/content/tissue_table.h"
#include "engine/files/error.h"
#include "engine/files/key.h"
#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::gltf {

/// Caps that keep a bad file from exhausting memory or time.
struct GltfLimits {
  std::size_t file_bytes = 256u << 20;
  std::size_t json_bytes = 64u << 20;
  std::size_t json_values = 1'000'000;
  int json_depth = 128;
  std::size_t elements = 5'000'000;  ///< vertices or indices of one accessor, and of the whole file
  int node_depth = 256;
  std::size_t instances = 100'000;  ///< elements of one list of the file: nodes, meshes, accessors, ...
  double coordinate_m = 100.0;      ///< |x| after transforms
};

/// extras.organ of a node (content/README.md, "Organs"). Empty id: none was written.
struct OrganAnnotation {
  std::string id;
  std::string role;  ///< one of organ_roles(); empty: not said
  std::string body;  ///< deformable body that carries the node; empty: none or not said
  bool deformable = false;
};

inline files::Names organ_roles() {
  return {"boundary", "region", "vessel", "target", "visual", "ignore"};
}

/// One node of the default scene that carries triangles.
struct GltfOrgan {
  std::string name;         ///< of the node, else of its mesh, else "node_<index>"
  std::string place;        ///< nodes/3
  mesh::TriangleMesh mesh;  ///< patient frame, metres; all triangle primitives of the node, not welded
  OrganAnnotation organ;
  std::optional<content::TissueAnnotation> tissue;
  std::array<float, 4> colour{0.8F, 0.8F, 0.8F, 1.0F};  ///< baseColorFactor, linear
};

struct GltfScene {
  std::vector<GltfOrgan> organs;      ///< in the order of the node graph, depth first
  std::vector<std::string> warnings;  ///< one line each
  /// What extras.organ and extras.tissue hold that no reader knows, one line each. A scenario refuses it; elsewhere
  /// it is worth a warning: other programs write their own keys.
  std::vector<std::string> unknown_annotations;
};

/// Reads a file; external buffers only from its own folder. @throws ContentError
GltfScene read_gltf(const std::filesystem::path& path, const GltfLimits& limits = {});

/// The same from memory; `name` stands for the file in messages and its parent folder holds external buffers.
/// @param pulse  called often meanwhile; may throw to end it
GltfScene read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& name,
                    const GltfLimits& limits = {}, const files::Pulse& pulse = {});

}  // namespace stylet::gltf
