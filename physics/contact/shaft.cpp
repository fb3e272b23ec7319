#include "physics/contact/shaft.h"

#include <algorithm>
#include <limits>

namespace stylet::physics {

using Eigen::Vector3d;

ShaftPoint project_on_shaft(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Vector3d& point) {
  const int last = static_cast<int>(nodes.cols()) - 2;
  ShaftPoint nearest;
  double nearest_squared = std::numeric_limits<double>::infinity();
  double overshoot = 0;  // of the nearest edge: fraction before it was clamped
  for (int beam = 0; beam <= last; ++beam) {
    const Vector3d edge = nodes.col(beam + 1) - nodes.col(beam);
    const double along = edge.dot(point - nodes.col(beam)) / edge.squaredNorm();
    const double fraction = std::clamp(along, 0.0, 1.0);
    const double squared = (nodes.col(beam) + fraction * edge - point).squaredNorm();
    if (squared < nearest_squared) {
      nearest_squared = squared;
      nearest.beam = beam;
      nearest.beam_fraction = fraction;
      overshoot = along;
    }
  }
  ShaftPoint result = shaft_point(nodes, nearest.beam, nearest.beam_fraction);
  result.distance = (result.position - point).norm();
  result.ahead_of_tip = nearest.beam == last && overshoot > 1;
  result.behind_hub = nearest.beam == 0 && overshoot < 0;
  return result;
}

ShaftPoint shaft_point(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, int beam, double beam_fraction) {
  ShaftPoint result;
  result.beam = beam;
  result.beam_fraction = beam_fraction;
  const Vector3d edge = nodes.col(beam + 1) - nodes.col(beam);
  result.position = nodes.col(beam) + beam_fraction * edge;
  result.tangent = edge.normalized();
  result.weights = {1 - beam_fraction, beam_fraction};
  return result;
}

Eigen::Matrix<double, 3, 2> lateral_directions(const Vector3d& tangent, const Eigen::Quaterniond& node_orientation) {
  const Vector3d own_x = node_orientation * Vector3d::UnitX();
  const Vector3d first = (own_x - tangent.dot(own_x) * tangent).normalized();
  Eigen::Matrix<double, 3, 2> directions;
  directions << first, tangent.cross(first);
  return directions;
}

}  // namespace stylet::physics
