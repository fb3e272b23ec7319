#include "engine/mesh/tet_quality.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace stylet::mesh {

DihedralRange dihedral_range(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                             const Eigen::Vector3d& d) {
  // Inward normals of the faces opposite a, b, c, d; the angle between faces i and j is pi - angle(n_i, n_j). Taken
  // from the orientation of the whole, an inverted tetrahedron turns them all and is reported as 0.
  const double volume6 = (b - a).dot((c - a).cross(d - a));
  if (!(volume6 > 0)) return {0, std::numbers::pi};
  const std::array<Eigen::Vector3d, 4> normal{(d - b).cross(c - b).normalized(), (c - a).cross(d - a).normalized(),
                                              (d - a).cross(b - a).normalized(), (b - a).cross(c - a).normalized()};
  double cos_max = -1;
  double cos_min = 1;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      const double cosine = -normal[i].dot(normal[j]);
      cos_max = std::max(cos_max, cosine);
      cos_min = std::min(cos_min, cosine);
    }
  }
  return {std::acos(std::clamp(cos_max, -1.0, 1.0)), std::acos(std::clamp(cos_min, -1.0, 1.0))};
}

TetQuality tet_quality(const physics::TetMesh& mesh) {
  TetQuality quality;
  double min_dihedral = std::numbers::pi;
  double max_dihedral = 0;
  for (const auto& tet : mesh.tets) {
    const Eigen::Vector3d& a = mesh.nodes[tet[0]];
    const Eigen::Vector3d& b = mesh.nodes[tet[1]];
    const Eigen::Vector3d& c = mesh.nodes[tet[2]];
    const Eigen::Vector3d& d = mesh.nodes[tet[3]];
    const double volume = (b - a).dot((c - a).cross(d - a)) / 6;
    quality.volume += volume;
    quality.inverted += volume > 0 ? 0 : 1;
    const DihedralRange range = dihedral_range(a, b, c, d);
    min_dihedral = std::min(min_dihedral, range.min);
    max_dihedral = std::max(max_dihedral, range.max);
  }
  quality.min_dihedral_deg = min_dihedral * 180 / std::numbers::pi;
  quality.max_dihedral_deg = max_dihedral * 180 / std::numbers::pi;
  return quality;
}

BoundarySurface boundary_surface(const physics::TetMesh& mesh, const files::Pulse& pulse) {
  // Faces of a positively oriented tetrahedron, counter-clockwise from outside.
  static constexpr std::array<std::array<int, 3>, 4> kFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  struct Face {
    std::array<int, 3> key;  // ascending
    std::array<int, 3> nodes;
    std::size_t index;  // of discovery, so that the output keeps the order of the tetrahedra
  };
  std::vector<Face> faces;
  faces.reserve(4 * mesh.tets.size());
  for (const auto& tet : mesh.tets) {
    pulse();
    for (const auto& corner : kFaces) {
      const std::array<int, 3> nodes{tet[corner[0]], tet[corner[1]], tet[corner[2]]};
      std::array<int, 3> key = nodes;
      std::sort(key.begin(), key.end());
      faces.push_back({key, nodes, faces.size()});
    }
  }
  std::sort(faces.begin(), faces.end(), [&](const Face& a, const Face& b) {
    pulse();
    return a.key != b.key ? a.key < b.key : a.index < b.index;
  });
  std::vector<Face> outer;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t next = i + 1;
    while (next < faces.size() && faces[next].key == faces[i].key) ++next;
    if (next - i == 1) outer.push_back(faces[i]);
    i = next;
  }
  std::sort(outer.begin(), outer.end(), [](const Face& a, const Face& b) { return a.index < b.index; });

  BoundarySurface boundary;
  for (const Face& face : outer) boundary.nodes.insert(boundary.nodes.end(), face.nodes.begin(), face.nodes.end());
  std::sort(boundary.nodes.begin(), boundary.nodes.end());
  boundary.nodes.erase(std::unique(boundary.nodes.begin(), boundary.nodes.end()), boundary.nodes.end());
  std::vector<std::uint32_t> vertex_of(mesh.nodes.size(), std::numeric_limits<std::uint32_t>::max());
  for (std::size_t v = 0; v < boundary.nodes.size(); ++v) {
    vertex_of[boundary.nodes[v]] = static_cast<std::uint32_t>(v);
    boundary.mesh.vertices.push_back(mesh.nodes[boundary.nodes[v]]);
  }
  for (const Face& face : outer) {
    boundary.mesh.triangles.push_back({vertex_of[face.nodes[0]], vertex_of[face.nodes[1]], vertex_of[face.nodes[2]]});
  }
  return boundary;
}

}  // namespace stylet::mesh
