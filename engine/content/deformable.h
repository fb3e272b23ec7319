// A closed organ becomes a deformable body: tetrahedra, their tissue, and the nodes that hold it.
#pragma once

#include "engine/content/anatomy.h"
#include "engine/content/scenario_file.h"
#include "engine/content/scene.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::content {

/// Tetrahedralises the boundary of `request`, gives each tetrahedron the tissue of the last region or target of
/// the body that contains its centroid (else of the boundary), and marks the fixed nodes. The mechanics of a
/// tetrahedron is the mean over its volume (20 points) of what lies there, vessels included: the last region that
/// contains a point counts. What is wrong is appended to `problems`; the body is then not to be used.
DeformableBody build_body(const BodyRequest& request, std::span<const Organ> organs, std::span<const Tissue> tissues,
                          const std::string& scenario, std::vector<std::string>& problems);

}  // namespace stylet::content
