#include "engine/render/geometry.h"

#include "engine/content/picture_labels.h"
#include "engine/render/probe_mesh.h"

#include <algorithm>

namespace stylet::render {

namespace {

// Below this opacity a tissue is drawn as glass; up to kCoverOpacity it is a cover, cut open towards the focus.
constexpr float kOpaque = 0.9F;
constexpr float kCoverOpacity = 0.5F;

SurfaceStyle style_of(const content::Tissue& tissue) {
  const auto [r, g, b, opacity] = tissue.colour;
  if (opacity >= kOpaque) return {{r, g, b, 1}, {0.42F, 1, 1, 0}, {kSolid, 0, 0, 0}};
  if (opacity > kCoverOpacity) return {{r, g, b, 0.5F * opacity}, {0.34F, 0.92F, 2.2F, 0}, {kGlass, 0, 0, 0}};
  return {{r, g, b, 1.25F * opacity}, {0.5F, 0.85F, 2.5F, 0}, {kCover, 0, 0, 0}};
}

/// The outside of a body whose tissues are drawn as covers of their own (skin over fat over muscle) shows nothing
/// new.
bool shown_by_its_regions(const content::Scene& scene, const content::Surface& surface) {
  if (surface.role != content::SurfaceRole::boundary || surface.body < 0) return false;
  return std::any_of(scene.surfaces.begin(), scene.surfaces.end(), [&](const content::Surface& other) {
    return other.role == content::SurfaceRole::region && other.body == surface.body &&
           style_of(scene.tissues[static_cast<std::size_t>(other.tissue)]).kind[0] == kCover;
  });
}

void push_vertex(Geometry& geometry, std::uint32_t anchor, const Eigen::Vector3f& position,
                 const Eigen::Vector3f& normal) {
  geometry.rest.push_back(
      {{anchor, 0, 0, 0}, {position.x(), position.y(), position.z(), 0}, {normal.x(), normal.y(), normal.z(), 0}});
}

Piece append(Geometry& geometry, std::string name, std::span<const std::uint32_t> indices, std::uint32_t base,
             const SurfaceStyle& style) {
  Piece piece{std::move(name),
              static_cast<std::uint32_t>(geometry.indices.size()),
              static_cast<std::uint32_t>(indices.size()),
              style,
              {}};
  for (std::uint32_t index : indices) geometry.indices.push_back(base + index);
  return piece;
}

Piece append(Geometry& geometry, std::string name, const ProbeMesh& mesh, const SurfaceStyle& style) {
  const auto base = static_cast<std::uint32_t>(geometry.rest.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    push_vertex(geometry, kFixedToProbe, mesh.positions[i], mesh.normals[i]);
  return append(geometry, std::move(name), mesh.indices, base, style);
}

Piece append(Geometry& geometry, const content::Surface& surface, std::uint32_t first_node,
             const SurfaceStyle& style) {
  const auto base = static_cast<std::uint32_t>(geometry.rest.size());
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    if (surface.body < 0) {
      push_vertex(geometry, surface.breathes ? kFixedToBreath : kFixedToPatient, surface.positions[i],
                  surface.normals[i]);
      continue;
    }
    const content::Embedding& e = surface.embedding[i];
    const Eigen::Vector3f& n = surface.normals[i];
    geometry.rest.push_back(
        {{first_node + e.nodes[0], first_node + e.nodes[1], first_node + e.nodes[2], first_node + e.nodes[3]},
         e.weights,
         {n.x(), n.y(), n.z(), 0}});
  }
  Piece piece = append(geometry, surface.name, surface.indices, base, style);
  constexpr std::size_t kSamples = 512;
  const std::size_t stride = std::max<std::size_t>(1, surface.positions.size() / kSamples);
  for (std::size_t i = 0; i < surface.positions.size(); i += stride)
    piece.samples.push_back(base + static_cast<std::uint32_t>(i));
  return piece;
}

}  // namespace

Geometry::Geometry(const content::Scene& scene)
    : needle(scene.needle.beams + 1, scene.needle.outer_diameter, scene.needle.length) {
  std::vector<std::uint32_t> first_node;
  for (const content::DeformableBody& body : scene.bodies) {
    first_node.push_back(static_cast<std::uint32_t>(rest_nodes.size() / 3));
    body_node_count.push_back(body.mesh.nodes.size());
    for (const Eigen::Vector3d& node : body.mesh.nodes)
      for (int axis = 0; axis < 3; ++axis) rest_nodes.push_back(static_cast<float>(node[axis]));
  }
  if (rest_nodes.empty()) rest_nodes.assign(3, 0);

  const auto tissues = static_cast<std::uint32_t>(scene.tissues.size());
  for (const content::Surface& surface : scene.surfaces) {
    const content::Tissue& tissue = scene.tissues[static_cast<std::size_t>(surface.tissue)];
    if (surface.indices.empty() || tissue.colour[3] <= 0 || shown_by_its_regions(scene, surface)) continue;
    SurfaceStyle style = style_of(tissue);
    style.kind[1] =
        surface.tissue > 0 ? static_cast<std::uint32_t>(surface.tissue) : tissues + content::kOutsideLabel;
    const std::uint32_t base = surface.body < 0 ? 0 : first_node[static_cast<std::size_t>(surface.body)];
    auto& pieces = style.kind[0] == kSolid ? solids : style.kind[0] == kGlass ? glass : covers;
    pieces.push_back(append(*this, surface, base, style));
  }
  const SurfaceStyle shell{
      {0.36F, 0.38F, 0.41F, 1}, {0.40F, 1, 1, 0}, {kMatte, tissues + content::kProbeLabel, 0, 0}};
  solids.push_back(append(*this, "probe", probe_body(scene.probe), shell));
  fan = append(*this, "fan", probe_fan(scene.probe), {});

  needle_base = static_cast<std::uint32_t>(rest.size());
  const SurfaceStyle steel{
      {0.72F, 0.74F, 0.78F, 1}, {0.3F, 1, 1, 0}, {kSteel, tissues + content::kNeedleLabel, 0, 0}};
  // ISO 6009 colours hubs by gauge; pink is 18G (1.2 mm).
  const SurfaceStyle hub{{0.78F, 0.22F, 0.36F, 1}, {0.35F, 1, 1, 0}, {kMatte, tissues + content::kNeedleLabel, 0, 0}};
  needle_pieces.push_back(append(*this, "needle", needle.shaft_indices(), needle_base, steel));
  needle_pieces.push_back(append(*this, "hub", needle.hub_indices(), needle_base, hub));
}

Eigen::Vector3f place(const RestVertex& vertex, const std::vector<float>& nodes) {
  const vec4& w = vertex.weights;
  if (vertex.nodes[0] >= kFixedToBreath) return {w[0], w[1], w[2]};
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const float* node = &nodes[3 * static_cast<std::size_t>(vertex.nodes[i])];
    sum += w[i] * Eigen::Vector3f(node[0], node[1], node[2]);
  }
  return sum;
}

}  // namespace stylet::render
