// The ultrasound probe as contact sees it: a rigid convex head with rounded rims.
#pragma once

#include <Eigen/Core>

namespace stylet::physics {

/// Probe frame: origin at the centre of the face, +Z into the body, +X lateral, +Y elevation. m.
/// The head is a box in the coordinates (arc length along the face, y, height above the face), its edges rounded.
struct ProbeShape {
  double face_radius = 0.060;  ///< of the convex face; 0: flat
  double half_width = 0.0385;  ///< along the arc, housing included
  double half_height = 0.010;  ///< in elevation, housing included
  double length = 0.080;       ///< of the head behind the face
  double rounding = 0.003;     ///< radius of the rims

  struct Distance {
    double value = 0;                                     ///< negative inside; exact on the face, m
    Eigen::Vector3d gradient = Eigen::Vector3d::UnitZ();  ///< unit, outward, probe frame
  };
  /// Signed distance of a point of the probe frame. Exact above the face and its rims up to the arc's curvature
  /// (distance / face_radius); behind the arc's centre it is only positive.
  Distance distance(const Eigen::Vector3d& x) const;

  /// Radius of a ball about the origin that holds the face and the sides to `depth` behind it.
  double reach(double depth) const;
};

}  // namespace stylet::physics
