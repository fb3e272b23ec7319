// The shaft as the beams themselves bend it: cubic between the nodes, with the nodes' own tangents.
#pragma once

#include "physics/contact/shaft.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>

#include <array>

namespace stylet::physics {

/// r(xi) = h00 x_a + h01 x_b + l (h10 t_a + h11 t_b) on every beam, t a node's own z axis, l the beam's rest length:
/// the shape functions of the bending beam, so a tissue point that passes a node meets neither a kink nor a jump of
/// the rows   (physics/README.md eq. 22). Continuous up to the shear angle, 1e-4 rad.
/// Directions are carried along the shaft by parallel transport from the hub: no fixed axis that could align with
/// the shaft, no turning about it.
/// @realtime everything here: no allocation
class HermiteShaft {
public:
  /// @param beam_length     rest length of a beam, m
  /// @param straight_edges  between the nodes, as the paper has them: to show what the curve is worth
  HermiteShaft(const NeedleShape& shape, double beam_length, bool straight_edges = false);

  int beams() const { return shape_.node_count - 1; }
  double length() const { return beams() * beam_length_; }
  Eigen::Vector3d tip() const { return shape_.positions.col(beams()); }
  const Eigen::Quaterniond& hub_orientation() const { return shape_.orientation(0); }
  Eigen::Vector3d hub_tangent() const { return tangent(0); }
  Eigen::Vector3d tip_tangent() const { return tangent(beams()); }
  /// Normal of the bevel, made normal to the shaft: unit.
  Eigen::Vector3d tip_bevel() const;
  /// Arc length from the hub to a point of the shaft, in needle material, m.
  double arc_length(const ShaftPoint& point) const { return (point.beam + point.beam_fraction) * beam_length_; }

  ShaftPoint at(int beam, double beam_fraction) const;
  ShaftPoint at_tip() const { return at(beams() - 1, 1); }
  /// The point of the shaft whose normal plane holds `point`: Newton from a guess, over the ends of beams.
  /// @param point     finite
  /// @param guess     arc length, m
  /// @param[out] arc  arc length; beyond the tip (or behind the hub) it goes on along the end's tangent, while the
  ///                  point returned is the end
  ShaftPoint project(const Eigen::Vector3d& point, double guess, double& arc) const;
  /// Two unit directions normal to the shaft and to each other, by parallel transport from the hub [3 x 2].
  Eigen::Matrix<double, 3, 2> lateral_directions(const ShaftPoint& point) const;

private:
  Eigen::Vector3d tangent(int node) const { return tangents_[node]; }

  const NeedleShape& shape_;
  double beam_length_;
  bool straight_edges_;
  std::array<Eigen::Vector3d, kMaxNeedleNodes> tangents_;  // unit
  std::array<Eigen::Vector3d, kMaxNeedleNodes> normals_;   // the first direction, transported from node to node
};

}  // namespace stylet::physics
