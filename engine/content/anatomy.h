// The organs of a scenario: glTF nodes joined by organ, with their tissue, role and body resolved.
#pragma once

#include "engine/content/gltf.h"
#include "engine/content/scenario_file.h"
#include "engine/content/scene.h"
#include "engine/content/triangle_mesh.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::content {

/// One organ of the patient: every node with the same organ id, role, body and tissue.
struct Organ {
  std::string id;
  std::string name;   ///< of its first node
  std::string place;  ///< file:/nodes/3, for messages
  std::string body;   ///< deformable body that carries it; empty: rigid
  SurfaceRole role = SurfaceRole::boundary;
  int tissue = 0;
  TriangleMesh mesh;  ///< welded and outward; closed unless role is visual
};

/// Joins and cleans the nodes of all organ files (`files[i]` was read from scenario.organs[i]). In file order: where
/// organs overlap, the later one counts. Tissues that a file
/// overrides are appended to `tissues`. What is wrong is appended to `problems`, one line each.
std::vector<Organ> build_anatomy(const ScenarioFile& scenario, std::span<const GltfScene> files,
                                 std::vector<Tissue>& tissues, std::vector<std::string>& problems);

/// The organ with an id: the boundary where several parts share it; nullptr: none.
const Organ* find_organ(std::span<const Organ> organs, const std::string& id);

}  // namespace stylet::content
