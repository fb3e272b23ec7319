#include "physics/contact/probe_shape.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {

ProbeShape::Distance ProbeShape::distance(const Eigen::Vector3d& x) const {
  // Unroll the arc: s along it, h above it. t and r are the unit vectors of ds and dh.
  double s = x.x();
  double h = x.z();
  Eigen::Vector3d t = Eigen::Vector3d::UnitX();
  Eigen::Vector3d r = Eigen::Vector3d::UnitZ();
  if (face_radius > 0) {
    const double up = x.z() + face_radius;
    const double angle = std::atan2(x.x(), up);
    s = face_radius * angle;
    h = std::hypot(x.x(), up) - face_radius;
    r = Eigen::Vector3d(std::sin(angle), 0, std::cos(angle));
    t = Eigen::Vector3d(r.z(), 0, -r.x());
  }
  // A box from h = -length to 0, shrunk by the rounding; q is how far beyond its sides the point is.
  const Eigen::Vector3d centred(s, x.y(), h + length / 2);
  const Eigen::Vector3d half(half_width - rounding, half_height - rounding, length / 2 - rounding);
  const Eigen::Vector3d q = centred.cwiseAbs() - half;
  Eigen::Vector3d outward = q.cwiseMax(0.0);
  const double outside = outward.norm();
  double value = outside - rounding;
  if (outside > 0) {
    outward /= outside;
  } else {
    int side = 0;
    value = q.maxCoeff(&side) - rounding;
    outward = Eigen::Vector3d::Unit(side);
  }
  for (int axis = 0; axis < 3; ++axis) outward[axis] = std::copysign(outward[axis], centred[axis]);
  return {value, outward.x() * t + outward.y() * Eigen::Vector3d::UnitY() + outward.z() * r};
}

double ProbeShape::reach(double depth) const {
  return std::hypot(half_width, half_height) + std::min(depth, length);
}

}  // namespace stylet::physics
