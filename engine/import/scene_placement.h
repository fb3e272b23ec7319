// Where things are in an imported scene: the entry and the probe on the skin, what holds the bodies.
#pragma once

#include "engine/import/derived_wall.h"
#include "engine/import/scene_import.h"
#include "engine/mesh/triangle_mesh.h"

#include <vector>

namespace stylet::import {

/// Fills entry, outward and probe of `scene`; its target is known, and the side file has entry and probe by now. What
/// is odd goes to its warnings.
/// @throws files::ContentError  too far from the skin; a needle along the body
void place_on_skin(const SideFile& side, const Body& body, ImportedScene& scene);

/// What holds the wall: its rim, the scan's cuts, the organs named.
std::vector<Hold> holds_of_wall(const SideFile& side, const Body& body, const ImportedScene& scene,
                                const mesh::TriangleMesh& wall);

/// What holds a deformable organ: the organs named, and the cuts that part it from the rest of itself.
std::vector<Hold> holds_of_organ(const SideOrgan& organ, const std::vector<ScanCut>& cuts,
                                 const mesh::TriangleMesh& surface);

/// The skin without what the wall shows of it. Open; of the same triangles.
mesh::TriangleMesh skin_outside_field(const SideFile& side, const Body& body, const ImportedScene& scene);

}  // namespace stylet::import
