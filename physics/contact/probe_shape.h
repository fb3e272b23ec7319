// The ultrasound probe as contact sees it: a rigid convex head with rounded rims.
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace stylet::physics {

/// Through which side of the head a point came in.
enum class ProbeSide : std::int8_t { none, face, plus_x, minus_x, plus_y, minus_y };

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
    Eigen::Vector3d gradient = Eigen::Vector3d::UnitZ();  ///< outward, probe frame; unit outside and on the surface
  };
  /// Signed distance of a point of the probe frame. Exact above the face and its rims up to the arc's curvature
  /// (distance / face_radius); behind the arc's centre it is only positive.
  Distance distance(const Eigen::Vector3d& x) const;

  /// The same for a point that came in through `side`: however deep it is, the way out is the way it came, and not
  /// through the side that is nearest. Outside distance() to the bit; inside it goes over to the way out through the
  /// next side under the rim, with a gradient that is continuous and, under the rim, longer than a unit vector: up
  /// to four times 5 mm deep.
  Distance distance_from(ProbeSide side, const Eigen::Vector3d& x) const;
  /// The side through which the straight way from `before` to `now` (in the head) comes in. From inside of the box
  /// the nearest one.
  ProbeSide entry(const Eigen::Vector3d& before, const Eigen::Vector3d& now) const;

  /// Radius of a ball about the origin that holds the face and the sides to `depth` behind it.
  double reach(double depth) const;

private:
  /// A point in the coordinates of the box, and the unit vectors of the first and the last in the probe frame.
  struct Unrolled {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< along the arc, y, above the face
    Eigen::Vector3d t = Eigen::Vector3d::UnitX();
    Eigen::Vector3d r = Eigen::Vector3d::UnitZ();
  };
  Unrolled unroll(const Eigen::Vector3d& x) const;
  /// Half the box, shrunk by the rounding; its middle is at (0, 0, -length / 2).
  Eigen::Vector3d core() const { return {half_width - rounding, half_height - rounding, length / 2 - rounding}; }
};

}  // namespace stylet::physics
