#include "engine/readers/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::readers {
namespace {

/// A triangle, in voxels.
struct Triangle {
  Eigen::Vector3f a, b, c;
};

/// Marks the voxels near one triangle.
void spread(const Triangle& triangle, SurfaceDistance& near) {
  const Eigen::Vector3f ab = triangle.b - triangle.a, bc = triangle.c - triangle.b, ca = triangle.a - triangle.c;
  const Eigen::Vector3f cross = ab.cross(-ca);
  const float area = cross.norm();
  if (!(area > 1e-9F)) return;
  const Eigen::Vector3f normal = cross / area;
  const Eigen::Vector3f corners[3] = {triangle.a, triangle.b, triangle.c};
  // Unit, within the plane: along each edge, and from it into the triangle.
  const float lengths[3] = {ab.norm(), bc.norm(), ca.norm()};
  const Eigen::Vector3f along[3] = {ab / lengths[0], bc / lengths[1], ca / lengths[2]};
  const Eigen::Vector3f inward[3] = {normal.cross(along[0]), normal.cross(along[1]), normal.cross(along[2])};
  const Eigen::Vector3i end = near.low + near.size;
  const auto from = [&](int axis) {
    const float least = std::min({triangle.a[axis], triangle.b[axis], triangle.c[axis]});
    return std::max(static_cast<int>(std::ceil(least - kNearSurface)), near.low[axis]);
  };
  const auto to = [&](int axis) {
    const float most = std::max({triangle.a[axis], triangle.b[axis], triangle.c[axis]});
    return std::min(static_cast<int>(std::floor(most + kNearSurface)), end[axis] - 1);
  };
  const int low_x = from(0), high_x = to(0), low_y = from(1), high_y = to(1), low_z = from(2), high_z = to(2);
  for (int k = low_z; k <= high_z; ++k) {
    for (int j = low_y; j <= high_y; ++j) {
      // Along the row, height over the plane and distances from the edges are linear.
      const Eigen::Vector3f start(0, static_cast<float>(j), static_cast<float>(k));
      const float height_at_0 = normal.dot(start - triangle.a);
      float inside_at_0[3], past_at_0[3];
      for (int e = 0; e < 3; ++e) {
        inside_at_0[e] = inward[e].dot(start - corners[e]);
        past_at_0[e] = along[e].dot(start - corners[e]);
      }
      std::uint8_t* row = near.steps.data() + near.at(near.low.x(), j, k);
      for (int i = low_x; i <= high_x; ++i) {
        const auto x = static_cast<float>(i);
        const float height = height_at_0 + x * normal.x();
        if (std::abs(height) >= kNearSurface) continue;
        float inside[3];
        for (int e = 0; e < 3; ++e) inside[e] = inside_at_0[e] + x * inward[e].x();
        if (std::min({inside[0], inside[1], inside[2]}) <= -kNearSurface) continue;
        // The nearest point is over the triangle, or on an edge that lies between.
        float beside2 = 0;
        for (int e = 0; e < 3; ++e) {
          if (inside[e] >= 0) continue;
          const float past = past_at_0[e] + x * along[e].x();
          const float beyond = past - std::clamp(past, 0.0F, lengths[e]);
          const float to_edge2 = inside[e] * inside[e] + beyond * beyond;
          beside2 = beside2 > 0 ? std::min(beside2, to_edge2) : to_edge2;
        }
        const float distance2 = height * height + beside2;
        if (distance2 >= kNearSurface * kNearSurface) continue;
        std::uint8_t& steps = row[i - near.low.x()];
        steps = std::min(steps, static_cast<std::uint8_t>(std::sqrt(distance2) / content::kEdgeStep + 0.5F));
      }
    }
  }
}

}  // namespace

SurfaceDistance surface_distance(const mesh::TriangleMesh& surface, const content::LabelVolume& volume) {
  std::vector<Eigen::Vector3f> vertices;
  Eigen::Array3f least = Eigen::Array3f::Constant(std::numeric_limits<float>::max()), most = -least;
  for (const Eigen::Vector3d& vertex : surface.vertices) {
    vertices.emplace_back(((vertex - volume.origin.cast<double>()) / volume.spacing).cast<float>());
    least = least.min(vertices.back().array());
    most = most.max(vertices.back().array());
  }
  SurfaceDistance near;
  if (vertices.empty()) return near;
  near.low = (least - kNearSurface).ceil().max(0).matrix().cast<int>();
  near.size =
      ((most + kNearSurface).floor().matrix().cast<int>().array() + 1).min(volume.size.array()).matrix() - near.low;
  near.size = near.size.cwiseMax(0);
  near.steps.assign(static_cast<std::size_t>(near.size.x()) * near.size.y() * near.size.z(), content::kNoEdge);
  for (const auto& [a, b, c] : surface.triangles) spread({vertices[a], vertices[b], vertices[c]}, near);
  return near;
}

}  // namespace stylet::readers
