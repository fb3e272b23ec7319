// The organs of a scenario: glTF nodes joined by organ, with their tissue, role and body resolved.
#pragma once

#include "engine/content/scene.h"
#include "engine/gltf/gltf.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/readers/scenario_file.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::readers {

/// One organ of the patient: every node with the same organ id, role, body and tissue.
struct Organ {
  std::string id;
  std::string name;   ///< of its first node
  std::string place;  ///< file:/nodes/3, for messages
  std::string body;   ///< deformable body that carries it; empty: rigid
  content::SurfaceRole role = content::SurfaceRole::boundary;
  int tissue = 0;
  mesh::TriangleMesh mesh;  ///< welded and outward; closed unless role is visual
};

/// Joins and cleans the nodes of all organ files (`files[i]` was read from scenario.organs[i]). In file order: where
/// organs overlap, the later one counts. Tissues that a file
/// overrides are appended to `tissues`. What is wrong is appended to `problems`, one line each.
std::vector<Organ> build_anatomy(const ScenarioFile& scenario, std::span<const gltf::GltfScene> files,
                                 std::vector<content::Tissue>& tissues, std::vector<std::string>& problems);

/// The organ with an id: the boundary where several parts share it; nullptr: none.
const Organ* find_organ(std::span<const Organ> organs, const std::string& id);

}  // namespace stylet::readers
