// An indexed triangle surface, as read from a file.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::content {

/// Patient frame, metres; counter-clockwise from outside where closed.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace stylet::content
