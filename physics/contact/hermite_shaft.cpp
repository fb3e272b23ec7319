#include "physics/contact/hermite_shaft.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;

/// `v` turned by the smallest rotation that takes the unit vector `from` to `to`; those must not be opposite.
Vector3d transport(const Vector3d& v, const Vector3d& from, const Vector3d& to) {
  const Vector3d axis = from.cross(to);
  return v + axis.cross(v) + axis.cross(axis.cross(v)) / (1 + from.dot(to));
}

}  // namespace

HermiteShaft::HermiteShaft(const NeedleShape& shape, double beam_length, bool straight_edges)
    : shape_(shape), beam_length_(beam_length), straight_edges_(straight_edges) {
  for (int i = 0; i < shape.node_count; ++i) {
    tangents_[i] = shape.orientation(i) * Vector3d::UnitZ();
    normals_[i] = i == 0 ? Vector3d(shape.orientation(0) * Vector3d::UnitX())
                         : transport(normals_[i - 1], tangents_[i - 1], tangents_[i]);
  }
}

Vector3d HermiteShaft::tip_bevel() const {
  const Vector3d own = shape_.orientation(beams()) * Vector3d::UnitX();
  return (own - tip_tangent().dot(own) * tip_tangent()).normalized();
}

ShaftPoint HermiteShaft::at(int beam, double beam_fraction) const {
  if (straight_edges_) return shaft_point(shape_.nodes(), beam, beam_fraction);
  const double x = beam_fraction;
  const double y = 1 - x;
  const double l = beam_length_;
  const Vector3d first = shape_.positions.col(beam);
  const Vector3d second = shape_.positions.col(beam + 1);
  ShaftPoint p;
  p.beam = beam;
  p.beam_fraction = x;
  p.weights = {y * y * (1 + 2 * x), x * x * (1 + 2 * y)};
  p.arms = {l * x * y * y * tangent(beam), -l * x * x * y * tangent(beam + 1)};
  p.position = p.weights[0] * first + p.weights[1] * second + p.arms[0] + p.arms[1];
  const Vector3d derivative =
      6 * x * y * (second - first) + l * y * (1 - 3 * x) * tangent(beam) + l * x * (3 * x - 2) * tangent(beam + 1);
  p.tangent = derivative.normalized();
  return p;
}

ShaftPoint HermiteShaft::project(const Vector3d& point, double guess, double& arc) const {
  constexpr int kMostIterations = 12;
  constexpr double kConverged = 1e-10;  // of a beam
  const double l = beam_length_;
  const double last = beams();
  if (straight_edges_) {
    const ShaftPoint nearest = project_on_shaft(shape_.nodes(), point);
    arc = arc_length(nearest);
    if (nearest.ahead_of_tip || nearest.behind_hub) arc += (point - nearest.position).dot(nearest.tangent);
    return nearest;
  }
  double s = guess > 0 ? std::min(guess / l, last) : 0;  // in beams; a guess that is no number is none
  ShaftPoint p;
  for (int i = 0; i < kMostIterations; ++i) {
    const int beam = std::min(static_cast<int>(s), beams() - 1);
    p = at(beam, s - beam);
    const Vector3d gap = point - p.position;
    const double along = gap.dot(p.tangent) / l;
    const double x = p.beam_fraction;
    const Vector3d curvature = ((6 - 12 * x) * (shape_.positions.col(beam + 1) - shape_.positions.col(beam)) +
                                l * (6 * x - 4) * tangent(beam) + l * (6 * x - 2) * tangent(beam + 1)) /
                               (l * l);
    // d/ds of gap . t = -1 + gap . curvature; far from the shaft, where that loses its sign, a shorter step
    const double step = along / std::max(0.25, 1 - gap.dot(curvature));
    const bool at_hub = s <= 0 && step <= 0;
    const bool at_tip = s >= last && step >= 0;
    if (at_hub || at_tip) {
      p.behind_hub = at_hub && along < 0;
      p.ahead_of_tip = at_tip && along > 0;
      arc = (s + along) * l;
      p.distance = gap.norm();
      return p;
    }
    s = std::clamp(s + std::clamp(step, -1.0, 1.0), 0.0, last);
    if (std::abs(step) < kConverged) break;
  }
  const int beam = std::min(static_cast<int>(s), beams() - 1);
  p = at(beam, s - beam);
  p.distance = (point - p.position).norm();
  arc = s * l;
  return p;
}

Eigen::Matrix<double, 3, 2> HermiteShaft::lateral_directions(const ShaftPoint& point) const {
  const auto node = static_cast<std::size_t>(point.beam);
  const Vector3d carried = transport(normals_[node], tangents_[node], point.tangent);
  Eigen::Matrix<double, 3, 2> directions;
  directions.col(0) = (carried - point.tangent.dot(carried) * point.tangent).normalized();
  directions.col(1) = point.tangent.cross(directions.col(0));
  return directions;
}

}  // namespace stylet::physics
