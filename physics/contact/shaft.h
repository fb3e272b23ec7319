// Where a tissue point touches the needle shaft, and the directions of its two lateral constraints: the shaft of the
// paper, with straight edges. The smooth one is in hermite_shaft.h.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>

namespace stylet::physics {

/// A point of the shaft, and how it moves with the two nodes of its beam: for translations u and spins w of those,
/// by the sum of weights[i] u_i + w_i x arms[i]   (physics/README.md eq. 14).
struct ShaftPoint {
  int beam = 0;
  double beam_fraction = 0;                            ///< 0 at the beam's first node, 1 at its second
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< patient frame, m
  Eigen::Vector3d tangent = Eigen::Vector3d::UnitZ();  ///< unit, towards the tip
  std::array<double, 2> weights{1, 0};
  std::array<Eigen::Vector3d, 2> arms{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  ///< m
  double distance = 0;        ///< of the projected point from the shaft, m
  bool ahead_of_tip = false;  ///< the point lies beyond the tip along the last edge
  bool behind_hub = false;    ///< the point lies behind the hub along the first edge
};

/// Closest point of the shaft (nearest over all edges; ties go to the edge nearer the hub).
/// @param nodes  node positions, hub first [3 x nodes, nodes >= 2]
/// @realtime     no allocation; O(nodes)
ShaftPoint project_on_shaft(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, const Eigen::Vector3d& point);

/// Point of the shaft at a given beam and fraction.
/// @realtime
ShaftPoint shaft_point(const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, int beam, double beam_fraction);

/// Two unit directions normal to the shaft and to each other [3 x 2]: the node's own x axis with its part along the
/// tangent removed, and tangent x that. They ride with the needle's material frame: continuous in time and along the
/// shaft, and never degenerate, because a node's z axis stays near the tangent (a fixed global axis would flip).
/// @param tangent           unit
/// @param node_orientation  of the first node of the beam, node frame -> patient frame
/// @realtime
Eigen::Matrix<double, 3, 2> lateral_directions(const Eigen::Vector3d& tangent,
                                               const Eigen::Quaterniond& node_orientation);

}  // namespace stylet::physics
