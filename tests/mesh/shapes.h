// Analytic surfaces for tests: written without the code under test.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

namespace stylet::mesh::test {

inline double ball_volume(double radius) {
  return 4.0 / 3 * std::numbers::pi * radius * radius * radius;
}

/// Icosahedron subdivided `levels` times, vertices on the sphere, outward.
inline TriangleMesh icosphere(const Eigen::Vector3d& centre, double radius, int levels) {
  const double phi = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  for (const auto& x : std::array<Eigen::Vector3d, 12>{{{-1, phi, 0},
                                                        {1, phi, 0},
                                                        {-1, -phi, 0},
                                                        {1, -phi, 0},
                                                        {0, -1, phi},
                                                        {0, 1, phi},
                                                        {0, -1, -phi},
                                                        {0, 1, -phi},
                                                        {phi, 0, -1},
                                                        {phi, 0, 1},
                                                        {-phi, 0, -1},
                                                        {-phi, 0, 1}}}) {
    mesh.vertices.push_back(x.normalized());
  }
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    const auto halve = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] =
          middle.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : mesh.triangles) {
      const std::uint32_t ab = halve(t[0], t[1]);
      const std::uint32_t bc = halve(t[1], t[2]);
      const std::uint32_t ca = halve(t[2], t[0]);
      finer.push_back({t[0], ab, ca});
      finer.push_back({ab, t[1], bc});
      finer.push_back({ca, bc, t[2]});
      finer.push_back({ab, bc, ca});
    }
    mesh.triangles = std::move(finer);
  }
  for (Eigen::Vector3d& x : mesh.vertices) x = centre + radius * x;
  return mesh;
}

/// Adds a surface turned inside out.
inline void append_flipped(TriangleMesh& mesh, TriangleMesh other) {
  for (auto& t : other.triangles) std::swap(t[1], t[2]);
  append(mesh, other);
}

}  // namespace stylet::mesh::test
