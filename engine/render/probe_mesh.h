// The ultrasound probe as it is seen: its body and its imaging plane, in the probe frame.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace stylet::render {

/// A mesh in the probe frame (origin at the centre of the face, +Z into the body, +X lateral), m; counter-clockwise
/// from outside.
struct ProbeMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  ///< unit, outward
  std::vector<std::uint32_t> indices;
};

/// Body of a hand-held transducer: the face follows the array (an arc if convex), the housing narrows to a grip.
ProbeMesh probe_body(const content::Probe& probe);

/// The imaging plane y = 0: a sector from the face to `depth` (convex) or a rectangle (linear). Seen from both sides.
ProbeMesh probe_fan(const content::Probe& probe);

}  // namespace stylet::render
