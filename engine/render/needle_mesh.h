// The needle as it is seen: a smooth tube along the bent shaft, bevelled at the tip, with a Luer hub.
#pragma once

#include "shaders/shared.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

inline constexpr double kBevelAngle =
    0.38;  ///< rad between the bevel's face and the axis; 22 degrees, a common grind

/// Builds the needle's vertices from the poses of its nodes. The triangles are the same for every shape.
class NeedleMesh {
public:
  /// @param nodes  of the needle, >= 2
  /// @param outer_diameter, length  m
  NeedleMesh(int nodes, double outer_diameter, double length);

  /// Triangles of the shaft, then of the hub, as indices into vertices.
  std::span<const std::uint32_t> shaft_indices() const { return shaft_indices_; }
  std::span<const std::uint32_t> hub_indices() const { return hub_indices_; }
  std::size_t vertex_count() const { return vertices_.size(); }
  float radius() const { return radius_; }  ///< of the shaft, m
  /// Whether that many positions and orientations are a pose of this needle.
  bool fits(std::size_t positions, std::size_t orientations) const {
    return positions == static_cast<std::size_t>(nodes_) && orientations == positions;
  }

  /// Vertices for the poses: a cubic Hermite curve through the positions, tangent to each node's +Z (needle frame),
  /// sections turned with the nodes; the bevel's face looks to +X of the tip.
  /// @param positions, orientations  [nodes] hub first, patient frame
  std::span<const DrawnVertex> shape(std::span<const Eigen::Vector3f> positions,
                                     std::span<const Eigen::Quaternionf> orientations);

private:
  static constexpr int kSides = 16;
  static constexpr int kSectionsPerBeam = 8;

  int nodes_;
  float radius_;
  float length_;
  std::vector<Eigen::Vector2f> hub_profile_;  ///< (z, radius) from the shaft backwards
  std::vector<std::uint32_t> shaft_indices_;
  std::vector<std::uint32_t> hub_indices_;
  std::vector<DrawnVertex> vertices_;
};

/// Point of the Hermite curve of a beam, and its derivative by u in [0, 1].
struct CurvePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f tangent;
};
/// @param x0, x1  end positions; t0, t1  unit tangents; length of the beam, m
CurvePoint hermite(const Eigen::Vector3f& x0, const Eigen::Vector3f& t0, const Eigen::Vector3f& x1,
                   const Eigen::Vector3f& t1, float length, float u);

}  // namespace stylet::render
