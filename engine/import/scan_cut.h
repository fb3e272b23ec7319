// Where a scan ends inside the body: flat faces that a surface has there, and the skin without them.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Geometry>

#include <string>
#include <vector>

namespace stylet::import {

/// A plane of the scan's volume that cuts the body off.
struct ScanCut {
  int axis = 0;     ///< 0 x, 1 y, 2 z of the patient frame
  double side = 1;  ///< +1: the body lies below the plane along the axis, -1: above
  double at = 0;    ///< coordinate of the plane, m
  double area = 0;  ///< of the flat face, m^2

  /// Metres beyond the plane, negative where there is body.
  double beyond(const Eigen::Vector3d& x) const { return side * (x[axis] - at); }
  /// "the feet", "the head", ...
  std::string name() const;
};

/// Faces of the body's bounding box that lie flat on it: a scan that ends there. Bodies are round elsewhere: a face
/// counts from a tenth of the box's face on.
std::vector<ScanCut> find_cuts(const mesh::TriangleMesh& body);

/// Flat area of a surface on a cut, m^2.
double area_on(const ScanCut& cut, const mesh::TriangleMesh& surface);

/// The triangles of the body's surface that are skin: all but those on a cut and the rounded rim there. Open.
mesh::TriangleMesh skin_of(const mesh::TriangleMesh& body, const std::vector<ScanCut>& cuts);

}  // namespace stylet::import
