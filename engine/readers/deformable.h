// A closed organ becomes a deformable body: tetrahedra, their tissue, and the nodes that hold it.
#pragma once

#include "engine/content/scene.h"
#include "engine/readers/anatomy.h"
#include "engine/readers/scenario_file.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::readers {

/// Fills tet_tissue and tet_mechanics of a body whose name and mesh are known. A tetrahedron gets the tissue of the
/// last region or target that the body carries and that contains its centroid, else of the boundary. Its mechanics is
/// the mean over its volume (20 points) of what lies there, vessels included: the last region that contains a point
/// counts. What lies in quadratic elements lies in layers: along the surfaces of the regions stiff as the mean,
/// across them soft as the mean of the softnesses.
void give_tissues(const Organ& boundary, std::span<const Organ> organs, std::span<const content::Tissue> tissues,
                  content::DeformableBody& body);

/// Tetrahedralises the boundary of `request`, gives the tetrahedra their tissues and marks the fixed nodes. What is
/// wrong is appended to `problems`; the body is then not to be used. What is odd to `warnings`.
content::DeformableBody build_body(const BodyRequest& request, std::span<const Organ> organs,
                                   std::span<const content::Tissue> tissues, const std::string& scenario,
                                   std::vector<std::string>& problems, std::vector<std::string>& warnings);

/// The regions and targets of a fluid tissue that `bodies` carry: the tetrahedra that have their tissue and their
/// centroid inside, of quadratic elements those that are such for the most part. One that is too small for the mesh,
/// or one too many, is appended to `problems`.
std::vector<content::Cavity> find_cavities(std::span<const Organ> organs, std::span<const content::Tissue> tissues,
                                           std::span<const content::DeformableBody> bodies,
                                           std::vector<std::string>& problems);

}  // namespace stylet::readers
