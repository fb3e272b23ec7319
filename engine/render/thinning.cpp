#include "engine/render/thinning.h"

#include "engine/mesh/decimation.h"

#include <algorithm>
#include <numeric>

namespace stylet::render {

namespace {

constexpr double kTurn = 20;    // degrees that a triangle may turn: normals are interpolated between corners
constexpr double kAspect = 30;  // of triangles, longest edge over height

}  // namespace

ThinnedSurface thinned(std::span<const Eigen::Vector3f> positions, std::span<const std::uint32_t> indices,
                       const Detail& detail) {
  ThinnedSurface result;
  if (!(detail.error > 0)) {
    result.vertices.resize(positions.size());
    std::iota(result.vertices.begin(), result.vertices.end(), 0U);
    result.indices.assign(indices.begin(), indices.end());
    return result;
  }
  mesh::TriangleMesh mesh;
  for (const Eigen::Vector3f& position : positions) mesh.vertices.push_back(position.cast<double>());
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  const auto left = mesh::decimated_triangles(
      mesh, {.turn_deg = kTurn, .aspect = kAspect, .error = detail.error, .edge = detail.edge});
  std::vector<std::uint32_t> place(positions.size(), 0);
  for (const auto& triangle : left)
    for (const std::uint32_t corner : triangle) place[corner] = 1;
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    if (place[i] == 0) continue;
    place[i] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(i);
  }
  for (const auto& triangle : left)
    for (const std::uint32_t corner : triangle) result.indices.push_back(place[corner]);
  return result;
}

}  // namespace stylet::render
