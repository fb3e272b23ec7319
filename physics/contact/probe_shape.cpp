#include "physics/contact/probe_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::physics {

ProbeShape::Unrolled ProbeShape::unroll(const Eigen::Vector3d& x) const {
  Unrolled point{.at = x};
  if (face_radius > 0) {
    const double up = x.z() + face_radius;
    const double angle = std::atan2(x.x(), up);
    point.at.x() = face_radius * angle;
    point.at.z() = std::hypot(x.x(), up) - face_radius;
    point.r = Eigen::Vector3d(std::sin(angle), 0, std::cos(angle));
    point.t = Eigen::Vector3d(point.r.z(), 0, -point.r.x());
  }
  return point;
}

ProbeShape::Distance ProbeShape::distance(const Eigen::Vector3d& x) const {
  const auto& [at, t, r] = unroll(x);
  // A box from h = -length to 0, shrunk by the rounding; q is how far beyond its sides the point is.
  const Eigen::Vector3d centred(at.x(), at.y(), at.z() + length / 2);
  const Eigen::Vector3d half = core();
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

ProbeShape::Distance ProbeShape::distance_from(ProbeSide side, const Eigen::Vector3d& x) const {
  if (side == ProbeSide::none) return distance(x);
  const auto& [at, t, r] = unroll(x);
  const Eigen::Vector3d half = core();
  // As in distance(), to the bit.
  const Eigen::Vector3d beyond(std::abs(at.x()) - half.x(), std::abs(at.y()) - half.y(),
                               at.z() + length / 2 - half.z());
  if (beyond.z() >= 0) return distance(x);
  const Eigen::Vector2d aside = beyond.head<2>().cwiseMax(0.0);
  const double outside = aside.norm();
  if (side != ProbeSide::face) {
    if (outside > 0) return distance(x);
    const bool along_x = side == ProbeSide::plus_x || side == ProbeSide::minus_x;
    const double sign = side == ProbeSide::plus_x || side == ProbeSide::plus_y ? 1 : -1;
    const int axis = along_x ? 0 : 1;
    return {sign * at[axis] - half[axis] - rounding,
            sign * (along_x ? t : Eigen::Vector3d(Eigen::Vector3d::UnitY()))};
  }
  if (outside >= rounding) return distance(x);
  if (outside == 0) return {beyond.z() - rounding, r};
  // g = z cos + outside sin - rounding, sin = outside / rounding: from the depth below the face, smoothly at the edge
  // of its flat part, to nothing at the side. Over the length of its gradient it is a distance of first order.
  const double sine = outside / rounding;
  const double cosine = std::sqrt(1 - sine * sine);
  const double slope = 2 * sine - beyond.z() * sine / (rounding * cosine);
  const double length_of_gradient = std::hypot(slope, cosine);
  const Eigen::Vector3d sideways = std::copysign(aside.x(), at.x()) / outside * t +
                                   std::copysign(aside.y(), at.y()) / outside * Eigen::Vector3d::UnitY();
  return {(beyond.z() * cosine + outside * sine - rounding) / length_of_gradient,
          (slope * sideways + cosine * r) / length_of_gradient};
}

ProbeSide ProbeShape::entry(const Eigen::Vector3d& before, const Eigen::Vector3d& now) const {
  const Eigen::Vector3d from = unroll(before).at;
  const Eigen::Vector3d to = unroll(now).at;
  const auto heights =
      [&](const Eigen::Vector3d& x) {  // above the planes of the box's sides, in the order of ProbeSide
        return std::array{x.z(), x.x() - half_width, -x.x() - half_width, x.y() - half_height, -x.y() - half_height};
      };
  const auto high = heights(from);
  const auto low = heights(to);
  // The last plane that it passes is the side that it comes in through; from inside, the nearest one.
  std::size_t side = 0;
  double latest = -1;
  bool inside = true;
  for (std::size_t i = 0; i < high.size(); ++i) {
    if (high[i] < 0) continue;
    inside = false;
    const double passed = low[i] < high[i] ? std::min(high[i] / (high[i] - low[i]), 1.0) : 1.0;
    if (passed > latest) {
      latest = passed;
      side = i;
    }
  }
  if (inside) side = static_cast<std::size_t>(std::max_element(high.begin(), high.end()) - high.begin());
  return static_cast<ProbeSide>(side + 1);
}

double ProbeShape::reach(double depth) const {
  return std::hypot(half_width, half_height) + std::min(depth, length);
}

}  // namespace stylet::physics
