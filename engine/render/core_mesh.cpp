#include "engine/render/core_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace stylet::render {

using Eigen::Vector3f;

CoreMesh::CoreMesh() : vertices_(kMost * kRings * kSides) {
  for (std::uint32_t core = 0; core < kMost; ++core) {
    for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
      for (std::uint32_t i = 0; i < kSides; ++i) {
        const std::uint32_t first = (core * kRings + ring) * kSides;
        const std::uint32_t a = first + i, b = first + (i + 1) % kSides;
        for (const std::uint32_t index : {a, b, b + kSides, a, b + kSides, a + kSides}) indices_.push_back(index);
      }
    }
  }
}

std::uint32_t CoreMesh::index_count(std::size_t cores) {
  return static_cast<std::uint32_t>(std::min(cores, kMost)) * (kRings - 1) * kSides * 6;
}

std::span<const DrawnVertex> CoreMesh::shape(std::span<const state::CoreTrack> cores) {
  const std::size_t count = std::min(cores.size(), kMost);
  std::size_t v = 0;
  for (const state::CoreTrack& core : cores.first(count)) {
    const Vector3f along = core.to - core.from;
    const Vector3f z = along.norm() > 1e-6F ? along.normalized() : Vector3f::UnitZ();
    const Vector3f x = z.unitOrthogonal();
    const Vector3f y = z.cross(x);
    const std::array rings{std::pair(core.from, 0.0F), std::pair(core.from, core.radius),
                           std::pair(core.to, core.radius), std::pair(core.to, 0.0F)};
    for (std::size_t ring = 0; ring < kRings; ++ring) {
      const auto& [middle, radius] = rings[ring];
      for (std::uint32_t side = 0; side < kSides; ++side) {
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(side) / kSides;
        const Vector3f across = std::cos(angle) * x + std::sin(angle) * y;
        const Vector3f n = ring == 0 ? Vector3f(-z) : ring + 1 == kRings ? z : across;
        const Vector3f p = middle + radius * across;
        vertices_[v++] = {{p.x(), p.y(), p.z(), 0}, {n.x(), n.y(), n.z(), 0}};
      }
    }
  }
  return std::span(vertices_).first(v);
}

}  // namespace stylet::render
