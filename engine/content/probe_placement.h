// Whether the probe of a scene lies on the skin and looks into the patient.
#pragma once

#include "engine/content/scene.h"

#include <string>

namespace stylet::content {

/// Farthest that the centre of the face may lie from the skin, m: gel and the dent of a pressed probe.
inline constexpr double kFarthestProbe = 0.010;

/// What is wrong with where the probe is held, or with the patient it is to meet (empty, in other units), without a
/// place; empty: its face lies on the skin and its axis meets the patient. The skin is where the labels change
/// between "outside" and the rest, to half a voxel. O(voxels).
std::string odd_probe_placement(const Probe& probe, const LabelVolume& labels);

}  // namespace stylet::content
