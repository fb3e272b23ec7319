#include "physics/contact/probe_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr double kUpright = 1 - 1e-9;  // sine: of a rim that is nearly the next side

}  // namespace

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
  const Distance nearest = distance(x);
  if (side == ProbeSide::none || nearest.value >= 0) return nearest;
  const auto& [at, t, r] = unroll(x);
  const Eigen::Vector3d half = core();
  const double below = at.z() + length / 2 - half.z();  // the level where the rim of the face begins, if negative
  const Eigen::Vector3d lateral = std::copysign(1, at.x()) * t;
  const Eigen::Vector3d elevation = std::copysign(1, at.y()) * Eigen::Vector3d::UnitY();
  // The way it came, and over the rim.
  double back = below, over = 0;
  Eigen::Vector3d out = r, aside;
  if (side == ProbeSide::face) {
    const Eigen::Vector2d beyond = (at.head<2>().cwiseAbs() - half.head<2>()).cwiseMax(0.0);
    over = beyond.norm();
    if (over > 0) aside = (beyond.x() * lateral + beyond.y() * elevation) / over;
  } else {
    const int axis = side == ProbeSide::plus_x || side == ProbeSide::minus_x ? 0 : 1;
    const double sign = side == ProbeSide::plus_x || side == ProbeSide::plus_y ? 1 : -1;
    if (std::abs(at[1 - axis]) > half[1 - axis]) return nearest;  // an edge between two sides
    back = sign * at[axis] - half[axis];
    over = std::max(0.0, below);
    out = sign * (axis == 0 ? t : Eigen::Vector3d(Eigen::Vector3d::UnitY()));
    aside = r;
  }
  if (over <= 0) return {back - rounding, out};
  // g = back cos + over sin - rounding, sin = over / rounding: from the depth behind the side, smoothly at the edge
  // of its flat part, to nothing at the next one. Over the length of its gradient it is a distance of first order.
  // The rim's own levels grow sharper with the depth: points that carry much would snap over them.
  const double sine = std::min(over / rounding, kUpright);
  const double cosine = std::sqrt(1 - sine * sine);
  const double tangent = sine / cosine;
  const double g = back * cosine + over * sine - rounding;
  const double by_over = 2 * sine - back / rounding * tangent;  // the gradient of g; by_back is the cosine
  const double by_over_twice = (2 - back / rounding / cosine * (1 + tangent * tangent)) / rounding;
  const double by_both = -tangent / rounding;
  const double length_of_gradient = std::hypot(by_over, cosine);
  const double longer_by_over = (by_over * by_over_twice + cosine * by_both) / length_of_gradient;
  const double longer_by_back = by_over * by_both / length_of_gradient;
  const double value = g / length_of_gradient;
  return {value, ((by_over - value * longer_by_over) * aside + (cosine - value * longer_by_back) * out) /
                     length_of_gradient};
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
