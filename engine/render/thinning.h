// The same surface in fewer triangles, where they would be smaller than pixels.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

/// In how many triangles surfaces are drawn.
struct Detail {
  double error = 0;     ///< m that a surface may be off by, about; 0: as authored
  double edge = 0.008;  ///< longest edge that is collapsed, m: what deforms an organ is not much larger
};

struct ThinnedSurface {
  std::vector<std::uint32_t> vertices;  ///< of the surface, that are left; ascending
  std::vector<std::uint32_t> indices;   ///< of triangles, into those
};

/// No vertex moves, so each keeps its normal and what carries it. Open edges stay. Deterministic.
ThinnedSurface thinned(std::span<const Eigen::Vector3f> positions, std::span<const std::uint32_t> indices,
                       const Detail& detail);

}  // namespace stylet::render
