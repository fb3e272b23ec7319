// The outside of a patient whose segmentation has none: skin round all that was segmented.
#pragma once

#include "engine/import/organ_source.h"
#include "engine/mesh/triangle_mesh.h"

#include <functional>
#include <string>
#include <vector>

namespace stylet::import {

/// How far the skin lies outside what was segmented where it is derived by a hull, m: fat and muscle that no label
/// names.
inline constexpr double kBodyWall = 0.020;

/// Whether a part is the body or its skin by its name ("body", "skin", "torso", ...).
bool names_body(const std::string& part);

struct DerivedBody {
  mesh::TriangleMesh surface{};  ///< closed, one piece, outward, patient frame
  std::string how{};             ///< one line: from what
};

/// Where a volume has a label of the body or its skin: all labels together, filled slice by slice. Else a hull: every
/// axial slice the convex hull of what is labelled there and, less by 0.3 of how far away, in the slices above and
/// below, smoothed along the body and grown by `kBodyWall`; it goes as far beyond the first and the last organ, but
/// where one is cut off by the end of the volume it ends there. Linear in voxels and vertices; the same input gives
/// the same bits.
/// @param pulse  called often meanwhile; may throw to end it
/// @throws files::ContentError  no label and no surface to derive it from
DerivedBody derive_body(const std::vector<SourceFile>& files, const std::function<void()>& pulse);

}  // namespace stylet::import
