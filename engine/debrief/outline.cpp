#include "engine/debrief/outline.h"

#include "engine/mesh/decimation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace stylet::debrief {

namespace {

using content::Surface;
using content::SurfaceRole;

constexpr double kNear = 0.09;     // m around the way: skin and bones
constexpr std::size_t kMost = 20;  // outlines on a page
/// Triangles that are looked at before they are made fewer; above that the surface takes seconds.
constexpr std::size_t kLargest = 400'000;

Eigen::Vector3d vertex_at(const Surface& surface, std::size_t i, const state::FrameState& moment) {
  if (surface.body < 0 || surface.embedding.size() != surface.positions.size()) {
    return (surface.positions[i] + (surface.breathes ? moment.breath : Eigen::Vector3f::Zero())).cast<double>();
  }
  const auto& nodes = moment.bodies[surface.body];
  const content::Embedding& at = surface.embedding[i];
  Eigen::Vector3f x = Eigen::Vector3f::Zero();
  for (std::size_t k = 0; k < 4; ++k) x += at.weights[k] * nodes[at.nodes[k]];
  return x.cast<double>();
}

/// The surface as it is at the moment, welded; of it what lies within `reach` of `around`.
mesh::TriangleMesh shape_of(const Surface& surface, const state::FrameState& moment, const Eigen::Vector3d& around,
                            double reach) {
  mesh::TriangleMesh mesh;
  std::map<std::tuple<float, float, float>, std::uint32_t> welded;  // by place at rest
  std::vector<std::uint32_t> index(surface.positions.size());
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    const Eigen::Vector3f& rest = surface.positions[i];
    const auto [found, fresh] =
        welded.try_emplace({rest.x(), rest.y(), rest.z()}, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(vertex_at(surface, i, moment));
    index[i] = found->second;
  }
  for (std::size_t i = 0; i + 2 < surface.indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> t{index[surface.indices[i]], index[surface.indices[i + 1]],
                                         index[surface.indices[i + 2]]};
    const bool near =
        std::ranges::all_of(t, [&](std::uint32_t v) { return (mesh.vertices[v] - around).norm() < reach; });
    if (near && t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  return mesh;
}

Outline outline_of(const Surface& surface, const content::Tissue& tissue, const mesh::TriangleMesh& mesh) {
  Outline outline{.name = surface.name, .colour = {tissue.colour[0], tissue.colour[1], tissue.colour[2]}};
  std::map<std::uint32_t, std::uint32_t> used;
  for (const auto& triangle : mesh.triangles) {
    auto& corners = outline.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [found, fresh] = used.try_emplace(triangle[k], static_cast<std::uint32_t>(outline.vertices.size()));
      if (fresh) outline.vertices.push_back(mesh.vertices[triangle[k]].cast<float>());
      corners[k] = found->second;
    }
  }
  return outline;
}

/// Bodies that carry a target; without any all of them.
std::vector<int> bodies_with_targets(const content::Scene& scene) {
  std::vector<int> bodies;
  for (const Surface& surface : scene.surfaces) {
    if (surface.role == SurfaceRole::target && surface.body >= 0) bodies.push_back(surface.body);
  }
  return bodies;
}

/// Triangles for a surface, and how far from the way it is shown; none: it is not.
struct Budget {
  std::size_t triangles = 0;
  double reach = std::numeric_limits<double>::infinity();
  bool shown = true;  // what lies around it would hide the way
};
Budget budget(const Surface& surface, const std::vector<int>& holders) {
  const bool holder = std::ranges::find(holders, surface.body) != holders.end();
  switch (surface.role) {
    case SurfaceRole::target:
      return {.triangles = 160};
    case SurfaceRole::boundary:
      if (surface.body >= 0)
        return holder ? Budget{.triangles = 700} : Budget{.triangles = 300, .reach = kNear, .shown = false};
      return {.triangles = 120, .reach = kNear};
    case SurfaceRole::vessel:
      if (holder) return {.triangles = 250, .reach = kNear};
      break;
    case SurfaceRole::region:
    case SurfaceRole::visual:
      break;
  }
  return {};
}

}  // namespace

std::vector<Outline> outlines_of(const content::Scene& scene, const state::FrameState& moment,
                                 const Eigen::Vector3d& around) {
  const std::vector<int> holders = bodies_with_targets(scene);
  std::vector<Outline> outlines;
  for (const Surface& surface : scene.surfaces) {
    const Budget wanted = budget(surface, holders);
    if (wanted.triangles == 0 || outlines.size() == kMost) continue;
    mesh::TriangleMesh mesh = shape_of(surface, moment, around, wanted.reach);
    if (mesh.triangles.empty() || mesh.triangles.size() > kLargest) continue;
    if (mesh.triangles.size() > wanted.triangles) {
      mesh = mesh::decimate(mesh, {.turn_deg = 80, .aspect = 40, .triangles = wanted.triangles});
    }
    if (mesh.triangles.size() <= 4 * wanted.triangles) {
      outlines.push_back(outline_of(surface, scene.tissues[surface.tissue], mesh));
      outlines.back().shown = wanted.shown;
    }
  }
  return outlines;
}

}  // namespace stylet::debrief
