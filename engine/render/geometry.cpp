#include "engine/render/geometry.h"

#include "engine/content/picture_labels.h"
#include "engine/render/probe_mesh.h"
#include "engine/render/room_mesh.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <limits>

namespace stylet::render {

namespace {

// Below this opacity a tissue is drawn as glass; up to kCoverOpacity it is a cover, cut open towards the focus.
constexpr float kOpaque = 0.9F;
constexpr float kCoverOpacity = 0.5F;

SurfaceStyle style_of(const content::Tissue& tissue) {
  const auto [r, g, b, opacity] = tissue.colour;
  if (opacity >= kOpaque) return {{r, g, b, 1}, {0.45F, 0, 0.25F, 0.7F}, {}, {kSolid, 0, 0, 0}};
  if (opacity > kCoverOpacity)
    return {{r, g, b, 0.5F * opacity}, {0.38F, 0, 0.25F, 0.5F}, {0.92F, 2.2F, 0, 0}, {kGlass, 0, 0, 0}};
  return {{r, g, b, 1.25F * opacity}, {0.52F, 0, 0.35F, 0.05F}, {0.85F, 2.5F, 0, 0}, {kCover, 0, 0, 0}};
}

/// What nothing deforms may have triangles of any size.
Detail rigid(Detail detail) {
  detail.edge = std::numeric_limits<double>::max();
  return detail;
}

/// The cloth goes with the skin, as stiffly as cloth does.
Detail of_cloth(Detail detail) {
  detail.edge *= 4;
  return detail;
}

/// The outside of a body whose tissues are drawn as covers of their own (skin over fat over muscle) shows nothing
/// new. Where no region has its tissue (skin, with fat and muscle in it) it does.
bool shown_by_its_regions(const content::Scene& scene, const content::Surface& surface) {
  if (surface.role != content::SurfaceRole::boundary || surface.body < 0) return false;
  const auto regions = [&](const auto& of_tissue) {
    return std::ranges::any_of(scene.surfaces, [&](const content::Surface& other) {
      return other.role == content::SurfaceRole::region && other.body == surface.body && of_tissue(other.tissue);
    });
  };
  const auto is_cover = [&](int tissue) { return style_of(scene.tissues[tissue]).kind[0] == kCover; };
  return regions(is_cover) && (!is_cover(surface.tissue) || regions([&](int t) { return t == surface.tissue; }));
}

void push_vertex(Geometry& geometry, std::uint32_t anchor, const Eigen::Vector3f& position,
                 const Eigen::Vector3f& normal) {
  geometry.rest.push_back({{anchor, 0, 0, 0},
                           {position.x(), position.y(), position.z(), 0},
                           {normal.x(), normal.y(), normal.z(), 0},
                           {}});
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
  const ThinnedSurface shown = thinned(mesh.positions, mesh.indices, rigid(geometry.detail));
  for (const std::uint32_t i : shown.vertices)
    push_vertex(geometry, kFixedToProbe, mesh.positions[i], mesh.normals[i]);
  return append(geometry, std::move(name), shown.indices, base, style);
}

/// Vertex of a surface. @param first_node  of its body
RestVertex vertex_of(const content::Surface& surface, std::size_t i, std::uint32_t first_node) {
  const Eigen::Vector3f& n = surface.normals[i];
  const vec4 normal{n.x(), n.y(), n.z(), 0};
  if (surface.body < 0) {
    const Eigen::Vector3f& p = surface.positions[i];
    return {{surface.breathes ? kFixedToBreath : kFixedToPatient, 0, 0, 0}, {p.x(), p.y(), p.z(), 0}, normal, {}};
  }
  const content::Embedding& e = surface.embedding[i];
  return {{first_node + e.nodes[0], first_node + e.nodes[1], first_node + e.nodes[2], first_node + e.nodes[3]},
          e.weights,
          normal,
          {}};
}

/// A few of `count` vertices from `base` on.
std::vector<std::uint32_t> samples_of(std::uint32_t base, std::size_t count) {
  constexpr std::size_t kSamples = 512;
  const std::size_t stride = std::max<std::size_t>(1, count / kSamples);
  std::vector<std::uint32_t> samples;
  for (std::size_t i = 0; i < count; i += stride) samples.push_back(base + static_cast<std::uint32_t>(i));
  return samples;
}

Piece append(Geometry& geometry, const content::Surface& surface, std::uint32_t first_node,
             const SurfaceStyle& style) {
  const auto base = static_cast<std::uint32_t>(geometry.rest.size());
  const ThinnedSurface shown = thinned(surface.positions, surface.indices, geometry.detail);
  for (const std::uint32_t i : shown.vertices) geometry.rest.push_back(vertex_of(surface, i, first_node));
  Piece piece = append(geometry, surface.name, shown.indices, base, style);
  piece.samples = samples_of(base, shown.vertices.size());
  return piece;
}

Piece append(Geometry& geometry, std::string name, const RoomMesh& mesh, const RoomLayout& layout,
             const SurfaceStyle& style) {
  const Detail detail = style.kind[0] == kCloth ? of_cloth(geometry.detail) : rigid(geometry.detail);
  const ThinnedSurface shown = thinned(mesh.positions, mesh.indices, detail);
  const auto base = static_cast<std::uint32_t>(geometry.rest.size());
  const Eigen::Isometry3f patient_from_table = layout.patient_from_table.cast<float>();
  for (const std::uint32_t i : shown.vertices) {
    push_vertex(geometry, kFixedToPatient, patient_from_table * mesh.positions[i],
                patient_from_table.linear() * mesh.normals[i]);
    if (mesh.coordinates.empty()) continue;
    geometry.rest.back().at = {mesh.coordinates[i][0], mesh.coordinates[i][1], 0, 0};
  }
  return append(geometry, std::move(name), shown.indices, base, style);
}

/// Points on it at rest, closer than the cloth's cells.
std::vector<Eigen::Vector3f> skin_of(const content::Scene& scene) {
  constexpr float kApart = 0.008F;  // m
  std::vector<Eigen::Vector3f> skin;
  for (const content::Surface& surface : scene.surfaces) {
    if (scene.tissues[surface.tissue].name != kSkin) continue;
    skin.insert(skin.end(), surface.positions.begin(), surface.positions.end());
    for (std::size_t t = 0; t + 2 < surface.indices.size(); t += 3) {
      const Eigen::Vector3f& a = surface.positions[surface.indices[t]];
      const Eigen::Vector3f ab = surface.positions[surface.indices[t + 1]] - a;
      const Eigen::Vector3f ac = surface.positions[surface.indices[t + 2]] - a;
      const int n = static_cast<int>(std::max({ab.norm(), ac.norm(), (ac - ab).norm()}) / kApart);
      for (int i = 0; i <= n && n > 0; ++i)
        for (int j = 0; i + j <= n; ++j)
          skin.push_back(a + (static_cast<float>(i) * ab + static_cast<float>(j) * ac) / static_cast<float>(n));
    }
  }
  return skin;
}

/// Lets cloth, or skin that is made up, go with the skin beside it: a vertex near one that a body carries is carried
/// by the same tetrahedron.
void lay_on_skin(Geometry& geometry, const Piece& piece, const content::Scene& scene,
                 const std::vector<Eigen::Vector3f>& skin_points) {
  constexpr float kNear = 0.02F;     // m
  constexpr float kFarthest = 4.0F;  // times a tetrahedron's size that its motion is carried on outside it
  std::size_t first_node = 0;
  std::vector<std::size_t> first_nodes;
  for (const content::DeformableBody& body : scene.bodies) {
    first_nodes.push_back(first_node);
    first_node += body.mesh.nodes.size();
  }
  Eigen::AlignedBox3f around;
  for (const Eigen::Vector3f& position : skin_points) around.extend(position);
  around.min().array() -= kNear;
  around.max().array() += kNear;
  const std::uint32_t* begin = &geometry.indices[piece.first_index];
  const auto [least, most] = std::minmax_element(begin, begin + piece.index_count);
  for (std::uint32_t i = *least; i <= *most; ++i) {
    RestVertex& vertex = geometry.rest[i];
    const Eigen::Vector3f at(vertex.weights[0], vertex.weights[1], vertex.weights[2]);
    if (!around.contains(at)) continue;
    float nearest = kNear * kNear;
    const content::Embedding* skin = nullptr;
    std::size_t body = 0;
    for (const content::Surface& surface : scene.surfaces) {
      if (surface.body < 0 || scene.tissues[surface.tissue].name != kSkin) continue;
      for (std::size_t k = 0; k < surface.positions.size(); ++k) {
        const float distance = (surface.positions[k] - at).squaredNorm();
        if (distance >= nearest) continue;
        nearest = distance;
        skin = &surface.embedding[k];
        body = static_cast<std::size_t>(surface.body);
      }
    }
    if (skin == nullptr) continue;
    Eigen::Matrix4f corners;
    for (int k = 0; k < 4; ++k)
      corners.col(k) = scene.bodies[body].mesh.nodes[skin->nodes[k]].cast<float>().homogeneous();
    const Eigen::Vector4f weights = corners.partialPivLu().solve(at.homogeneous().eval());
    if (!weights.allFinite() || weights.cwiseAbs().maxCoeff() > kFarthest) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      vertex.nodes[k] = static_cast<std::uint32_t>(first_nodes[body]) + skin->nodes[k];
      vertex.weights[k] = weights[static_cast<int>(k)];
    }
  }
}

/// Sorts the triangles of the cloth: those clear of the field's opening first.
void split_drape(Geometry& geometry, const RoomLayout& layout) {
  const Piece& drape = geometry.drape.front();
  using Triangle = std::array<std::uint32_t, 3>;
  std::vector<Triangle> triangles(drape.index_count / 3);
  const auto first = geometry.indices.begin() + drape.first_index;
  for (std::size_t t = 0; t < triangles.size(); ++t) std::copy_n(first + 3 * t, 3, triangles[t].begin());
  const Eigen::AlignedBox2f field(-layout.field_half.cast<float>(), layout.field_half.cast<float>());
  const auto closed = [&](const Triangle& triangle) {
    Eigen::AlignedBox2f box;
    for (const std::uint32_t i : triangle)
      box.extend(Eigen::Vector2f(geometry.rest[i].at[0], geometry.rest[i].at[1]));
    return !box.intersects(field);
  };
  const auto open = std::stable_partition(triangles.begin(), triangles.end(), closed);
  for (std::size_t t = 0; t < triangles.size(); ++t) std::ranges::copy(triangles[t], first + 3 * t);
  Piece clear = drape, beside = drape;
  beside.index_count = static_cast<std::uint32_t>(3 * (triangles.end() - open));
  clear.index_count -= beside.index_count;
  beside.first_index += clear.index_count;
  geometry.drape_closed = {clear};
  geometry.drape_open = {beside};
}

void append_room(Geometry& geometry, const content::Scene& scene, const RoomLayout& layout) {
  const std::vector<Eigen::Vector3f> skin = skin_of(scene);
  const RoomMeshes meshes = room_meshes(layout, skin);
  const auto style = [](std::array<float, 3> c, vec4 surface, std::uint32_t kind = kMatte) {
    return SurfaceStyle{{c[0], c[1], c[2], 1}, surface, {}, {kind, 0, 0, 0}};
  };
  const auto add = [&](std::vector<Piece>& to, const char* name, const RoomMesh& mesh, const SurfaceStyle& look) {
    if (!mesh.indices.empty()) to.push_back(append(geometry, name, mesh, layout, look));
  };
  add(geometry.drape, "drape", meshes.drape, style({0.030F, 0.145F, 0.190F}, {0.88F, 0, 0.2F, 0}, kCloth));
  if (!geometry.drape.empty()) {
    lay_on_skin(geometry, geometry.drape.front(), scene, skin);
    split_drape(geometry, layout);
  }
  const auto tissue = std::ranges::find(scene.tissues, kSkin, &content::Tissue::name);
  if (tissue != scene.tissues.end() && style_of(*tissue).kind[0] == kCover) {
    SurfaceStyle look = style_of(*tissue);
    look.kind[1] = static_cast<std::uint32_t>(tissue - scene.tissues.begin());
    add(geometry.lining, "lining", meshes.lining, look);
    if (!geometry.lining.empty()) lay_on_skin(geometry, geometry.lining.front(), scene, skin);
  }
  add(geometry.cavity, "cavity", meshes.cavity, style({0.050F, 0.015F, 0.012F}, {0.6F, 0, 0, 0.15F}, kCavity));
  add(geometry.cavity, "cut", meshes.cut, style({0.36F, 0.11F, 0.085F}, {0.6F, 0, 0, 0.15F}, kCavity));
  geometry.cavity_rings = meshes.cavity.positions;
  add(geometry.room, "mattress", meshes.mattress, style({0.022F, 0.024F, 0.028F}, {0.55F, 0, 0, 0.1F}));
  add(geometry.room, "enamel", meshes.enamel, style({0.66F, 0.68F, 0.68F}, {0.40F, 0, 0, 0.3F}));
  add(geometry.room, "dark", meshes.dark, style({0.020F, 0.022F, 0.026F}, {0.40F, 0, 0, 0}));
  add(geometry.room, "steel", meshes.steel, style({0.60F, 0.60F, 0.61F}, {0.32F, 1, 0, 0}));
  const SurfaceStyle screen = style({0.006F, 0.007F, 0.009F}, {0.2F, 0, 0, 0}, kScreen);
  add(geometry.room, "screen", meshes.screen, screen);
  add(geometry.room, "glow", meshes.glow, style({1.0F, 0.97F, 0.90F}, {1, 0, 0, 0}, kGlow));
  add(geometry.panel, "panel_arm", meshes.panel_arm, style({0.66F, 0.68F, 0.68F}, {0.40F, 0, 0, 0.3F}));
  add(geometry.panel, "panel_case", meshes.panel_case, style({0.020F, 0.022F, 0.026F}, {0.40F, 0, 0, 0}));
  geometry.panel_picture = append(geometry, "panel_picture", meshes.panel_picture, layout, screen);
}

}  // namespace

Geometry::Geometry(const content::Scene& scene, const RoomLayout* layout, const Detail& wanted)
    : detail(wanted),
      needle(scene.needle.beams + 1, scene.needle.outer_diameter, scene.needle.length),
      syringe(scene.cavities.empty() ? 0 : kSyringeParts) {
  std::vector<std::uint32_t> first_node;
  for (const content::DeformableBody& body : scene.bodies) {
    first_node.push_back(static_cast<std::uint32_t>(rest_nodes.size()));
    body_node_count.push_back(body.mesh.nodes.size());
    for (const Eigen::Vector3d& node : body.mesh.nodes) rest_nodes.push_back(node.cast<float>());
  }
  if (rest_nodes.empty()) {
    rest_nodes.emplace_back(0, 0, 0);
    body_node_count.push_back(1);
  }

  const auto tissues = static_cast<std::uint32_t>(scene.tissues.size());
  for (const content::Surface& surface : scene.surfaces) {
    const content::Tissue& tissue = scene.tissues[surface.tissue];
    if (surface.indices.empty() || tissue.colour[3] <= 0 || shown_by_its_regions(scene, surface)) continue;
    SurfaceStyle style = style_of(tissue);
    style.kind[1] =
        surface.tissue > 0 ? static_cast<std::uint32_t>(surface.tissue) : tissues + content::kOutsideLabel;
    const std::uint32_t base = surface.body < 0 ? 0 : first_node[surface.body];
    auto& pieces = style.kind[0] == kSolid ? solids : style.kind[0] == kGlass ? glass : covers;
    pieces.push_back(append(*this, surface, base, style));
    if (style.kind[0] != kSolid || surface.role != content::SurfaceRole::target) continue;
    pieces.back().target = true;
    Piece& glassy = glass_targets.emplace_back(pieces.back());
    glassy.style.kind[0] = kGlass;
    glassy.style.colour[3] = 0.3F;
    glassy.style.glass = {0.9F, 1.5F, 0, 0};
  }
  const SurfaceStyle shell{
      {0.50F, 0.52F, 0.54F, 1}, {0.42F, 0, 0, 0.3F}, {}, {kMatte, tissues + content::kProbeLabel, 0, 0}};
  solids.push_back(append(*this, "probe", probe_body(scene.probe), shell));
  fan = append(*this, "fan", probe_fan(scene.probe), {});

  if (layout != nullptr) append_room(*this, scene, *layout);

  if (scene.exercise.plan && scene.exercise.plan->destroys) {
    // Coagulated liver is pale; the warm colour tells it from the organs.
    zone = {"ablation_zone",
            static_cast<std::uint32_t>(indices.size()),
            0,
            {{1.0F, 0.30F, 0.02F, 0.55F}, {0.5F, 0, 0.45F, 0.3F}, {0.97F, 1.4F, 0, 0}, {kGlass, 0, 0, 0}},
            {}};
    zone_base = static_cast<std::uint32_t>(rest.size());
    zone_room = kMostZoneVertices;
    rest.resize(rest.size() + zone_room);
    indices.resize(indices.size() + std::size_t{6} * zone_room);
  }

  needle_base = static_cast<std::uint32_t>(rest.size());
  const SurfaceStyle steel{
      {0.66F, 0.66F, 0.67F, 1}, {0.30F, 1, 0, 0}, {}, {kSteel, tissues + content::kNeedleLabel, 0, 0}};
  // ISO 6009 colours hubs by gauge; pink is 18G (1.2 mm).
  const SurfaceStyle hub{
      {0.78F, 0.16F, 0.30F, 1}, {0.35F, 0, 0.1F, 0.4F}, {}, {kMatte, tissues + content::kNeedleLabel, 0, 0}};
  needle_pieces.push_back(append(*this, "needle", needle.shaft_indices(), needle_base, steel));
  needle_pieces.push_back(append(*this, "hub", needle.hub_indices(), needle_base, hub));
  core_base = needle_base + static_cast<std::uint32_t>(needle.vertex_count());
  core_piece = append(*this, "cores", cores.indices(), core_base,
                      {{0.93F, 0.80F, 0.58F, 1}, {0.5F, 0, 0.3F, 0.3F}, {}, {kMatte, 0, 0, 0}});
  syringe_base = core_base + static_cast<std::uint32_t>(cores.vertex_count());
  if (syringe.vertex_count() > 0) {
    const auto part = [&](const char* name, SyringePart first, SyringePart last, const SurfaceStyle& style) {
      const std::uint32_t begin = RodMesh::index_count(static_cast<std::size_t>(first));
      const std::uint32_t end = RodMesh::index_count(static_cast<std::size_t>(last) + 1);
      return append(*this, name, syringe.indices().subspan(begin, end - begin), syringe_base, style);
    };
    syringe_pieces = {part("fluid", SyringePart::fluid, SyringePart::fluid,
                           {{0.80F, 0.56F, 0.12F, 1}, {0.25F, 0, 0.3F, 0.5F}, {}, {kMatte, 0, 0, 0}}),
                      part("seal", SyringePart::seal, SyringePart::seal,
                           {{0.02F, 0.02F, 0.022F, 1}, {0.6F, 0, 0, 0.1F}, {}, {kMatte, 0, 0, 0}}),
                      part("plunger", SyringePart::stem, SyringePart::nozzle,
                           {{0.72F, 0.74F, 0.75F, 1}, {0.4F, 0, 0.1F, 0.3F}, {}, {kMatte, 0, 0, 0}})};
    barrel = part("barrel", SyringePart::barrel, SyringePart::barrel,
                  {{0.75F, 0.82F, 0.86F, 0.16F}, {0.15F, 0, 0, 0.8F}, {0.75F, 1.6F, 0, 0}, {kGlass, 0, 0, 0}});
  }
  shot_base = syringe_base + static_cast<std::uint32_t>(syringe.vertex_count());
  shot_piece = append(*this, "shot", shot.indices(), shot_base, steel);
  hand_base = shot_base + static_cast<std::uint32_t>(shot.vertex_count());
  const std::uint32_t of_a_hand = RodMesh::index_count(kControllerParts);
  const auto controller = [&](const char* name, std::uint32_t begin, const vec4& colour) {
    return append(*this, name, hands.indices().subspan(begin, of_a_hand), hand_base,
                  {colour, {0.45F, 0, 0, 0.3F}, {}, {kMatte, 0, 0, 0}});
  };
  hand_pieces = {controller("needle's controller", 0, {0.62F, 0.20F, 0.30F, 1}),
                 controller("probe's controller", of_a_hand, {0.16F, 0.18F, 0.20F, 1})};
  if (layout != nullptr) {
    cable.emplace(*layout);
    cable_base = hand_base + static_cast<std::uint32_t>(hands.vertex_count());
    cable_piece = append(*this, "cable", cable->indices(), cable_base,
                         {{0.060F, 0.064F, 0.070F, 1}, {0.55F, 0, 0, 0.2F}, {}, {kMatte, 0, 0, 0}});
  }
}

ZoneGeometry zone_geometry(const content::HeatedZone& zone, const Geometry& geometry) {
  const content::Surface& surface = zone.surface;
  std::uint32_t first_node = 0;
  for (int body = 0; body < surface.body; ++body)
    first_node += static_cast<std::uint32_t>(geometry.body_node_count[body]);
  ZoneGeometry out{.piece = geometry.zone};
  const std::size_t vertices = std::min<std::size_t>(surface.positions.size(), geometry.zone_room);
  for (std::size_t i = 0; i < vertices; ++i) out.rest.push_back(vertex_of(surface, i, first_node));
  const std::size_t most_indices = std::size_t{6} * geometry.zone_room;
  for (std::size_t t = 0; t + 2 < surface.indices.size() && out.indices.size() < most_indices; t += 3) {
    const std::span triangle = std::span(surface.indices).subspan(t, 3);
    if (std::ranges::any_of(triangle, [&](std::uint32_t i) { return i >= vertices; })) continue;
    for (const std::uint32_t i : triangle) out.indices.push_back(geometry.zone_base + i);
  }
  out.piece.index_count = static_cast<std::uint32_t>(out.indices.size());
  out.piece.samples = samples_of(geometry.zone_base, vertices);
  return out;
}

Eigen::Vector3f place(const RestVertex& vertex, const BodyNodes& bodies) {
  const vec4& w = vertex.weights;
  if (vertex.nodes[0] >= kFixedToBreath) return {w[0], w[1], w[2]};
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    std::size_t node = vertex.nodes[i];
    std::size_t body = 0;
    while (node >= bodies[body].size()) node -= bodies[body++].size();
    sum += w[i] * bodies[body][node];
  }
  return sum;
}

}  // namespace stylet::render
