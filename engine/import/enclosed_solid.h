// The solid that a dirty surface encloses: patches that do not quite meet, double walls, overlaps, any orientation.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <vector>

namespace stylet::import {

/// Everything that cannot be reached from outside through an opening wider than `gap`.
///
/// A grid of nodes `spacing` apart is flooded from its rim; nodes closer than r = gap/2 to a triangle stop the flood.
/// The solid is what lies further than r from the flooded set (a morphological closing with a ball of radius r):
/// where there is a wall its surface is the wall's outer face, where there is an opening a patch across it. What lies
/// inside other walls does not matter. Distance to the flooded set: the point of the ball's surface nearest to the
/// triangle is carried along from node to node (Danielsson's vector distance transform), so the surface is exact to a
/// fraction of the spacing.
class EnclosedSolid {
public:
  /// What bounds memory and time, whatever the file.
  struct Limits {
    double nodes = 8e6;
    double work = 100e6;  ///< nodes looked at, all triangles together, beyond those of points: seconds, not hours
  };

  /// @param soup     any triangles, not empty; not kept
  /// @param gap      at least 2 spacing, m
  /// @param spacing  between nodes, m; it grows, and the gap with it, until the limits hold
  /// @param pulse    called often meanwhile; may throw to end it
  EnclosedSolid(const mesh::TriangleMesh& soup, double gap, double spacing, const Limits& limits,
                const files::Pulse& pulse = {});
  EnclosedSolid(const mesh::TriangleMesh& soup, double gap, double spacing)
      : EnclosedSolid(soup, gap, spacing, Limits{}) {}

  /// Metres, negative inside; a fraction of the spacing wrong. Outside the grid: positive.
  double signed_distance(const Eigen::Vector3d& point) const;

  double gap() const { return gap_; }
  double spacing() const { return spacing_; }
  /// Of the nodes inside, m^3.
  double volume() const;
  /// Of its surface, m^2: that of a thin wall is its two sides. A tenth wrong, more where curved within a few
  /// spacings.
  double area() const;
  /// Largest distance from the surface of a node inside, m. A double wall has its thickness, whatever its volume.
  double depth() const;
  /// Of the soup; contains the solid.
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

private:
  Eigen::AlignedBox3d bounds_;
  double gap_;
  double spacing_;
  Eigen::Vector3f origin_;
  Eigen::Vector3i size_;         // nodes along each axis
  std::vector<float> distance_;  // [nodes] signed, m
};

}  // namespace stylet::import
