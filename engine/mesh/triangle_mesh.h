// An indexed triangle surface, as read from a file.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::mesh {

/// Patient frame, metres; counter-clockwise from outside where closed.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Adds the triangles of another surface; nothing is welded.
inline void append(TriangleMesh& to, const TriangleMesh& from) {
  const auto base = static_cast<std::uint32_t>(to.vertices.size());
  to.vertices.insert(to.vertices.end(), from.vertices.begin(), from.vertices.end());
  for (const auto& [a, b, c] : from.triangles) to.triangles.push_back({base + a, base + b, base + c});
}

}  // namespace stylet::mesh
