// The solid inside a closed surface: distance to it, from a bounding volume hierarchy over its triangles.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::mesh {

/// Signed distance to a closed, oriented surface (solid_surface() gives one).
///
/// Sign by the angle-weighted pseudo-normal of the nearest feature, exact on closed surfaces that do not intersect
/// themselves: Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal", TVCG 2005.
/// Const access from several threads is safe.
class Solid {
public:
  /// @param pulse  called often meanwhile; may throw to end it
  explicit Solid(TriangleMesh surface, const files::Pulse& pulse = {});

  /// Metres, negative inside. O(log triangles).
  double signed_distance(const Eigen::Vector3d& point) const;
  bool contains(const Eigen::Vector3d& point) const { return signed_distance(point) < 0; }

  struct Nearest {
    Eigen::Vector3d point;   ///< on the surface
    Eigen::Vector3d normal;  ///< pseudo-normal there, unit, outward
    std::uint32_t triangle = 0;
    double distance = 0;  ///< unsigned, m
  };
  Nearest nearest(const Eigen::Vector3d& point) const;

  /// Number of times the segment crosses the surface; a feature hit exactly on an edge may count for both triangles.
  int crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  const TriangleMesh& surface() const { return surface_; }
  const Eigen::AlignedBox3d& bounds() const { return nodes_.front().box; }

private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0;  ///< leaf: first entry of order_; inner: right child (the left one follows its parent)
    std::uint32_t count = 0;  ///< leaf: triangles; inner: 0
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count, const std::vector<Eigen::AlignedBox3d>& boxes,
                      const files::Pulse& pulse);

  TriangleMesh surface_;
  std::vector<std::uint32_t> order_;  ///< triangles as the leaves list them
  std::vector<Node> nodes_;
  std::vector<Eigen::Vector3d> vertex_normals_;               ///< angle weighted           [vertices]
  std::vector<std::array<Eigen::Vector3d, 3>> edge_normals_;  ///< of edge i -> i+1         [triangles]
};

}  // namespace stylet::mesh
