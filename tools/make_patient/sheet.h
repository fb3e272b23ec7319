// Closed surfaces made from parameters: sheets with a thickness, and swept tubes.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>

#include <functional>
#include <span>
#include <vector>

namespace stylet::patient {

/// Maps (u, v) in [0,1]^2 and a side to a point. Seen from outside the body, v runs up where u runs to the patient's
/// right (to the left of the picture), so that u x v points inward.
using SheetPoint = std::function<Eigen::Vector3d(double u, double v, bool outer)>;

/// Both faces of a sheet on a grid of columns x rows cells, and the rim between them.
mesh::TriangleMesh sheet(int columns, int rows, const SheetPoint& point);

/// One ring of a tube: an ellipse with half axes along two directions.
struct Ring {
  Eigen::Vector3d centre;
  Eigen::Vector3d half_axis_1;  ///< axis 1 x axis 2 points along the tube, from the first ring to the last
  Eigen::Vector3d half_axis_2;
};

/// Rings joined to a tube, closed by a point half a ring width beyond the first and the last.
mesh::TriangleMesh tube(std::span<const Ring> rings, int sides);

}  // namespace stylet::patient
