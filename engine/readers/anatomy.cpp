#include "engine/readers/anatomy.h"

#include "engine/content/tissue_table.h"
#include "engine/mesh/surface_mesh.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <tuple>

namespace stylet::readers {
namespace {

content::SurfaceRole role_of(const std::string& name) {
  static const std::map<std::string, content::SurfaceRole> kRoles{{"boundary", content::SurfaceRole::boundary},
                                                                  {"region", content::SurfaceRole::region},
                                                                  {"vessel", content::SurfaceRole::vessel},
                                                                  {"target", content::SurfaceRole::target},
                                                                  {"visual", content::SurfaceRole::visual}};
  const auto found = kRoles.find(name);
  return found == kRoles.end() ? content::SurfaceRole::boundary : found->second;
}

int resolve_tissue(const gltf::GltfOrgan& node, const std::string& chosen, const std::string& place,
                   std::vector<content::Tissue>& tissues, std::vector<std::string>& problems) {
  content::TissueAnnotation annotation;
  if (!chosen.empty()) {
    annotation.preset = chosen;
  } else if (node.tissue) {
    annotation = *node.tissue;
  } else {
    problems.push_back(
        fmt::format("{}: {} has no tissue; add extras.tissue to its material, or a tissue in the "
                    "scenario's organs/nodes",
                    place, node.name));
    return 0;
  }
  const int tissue = content::find_or_add_tissue(tissues, annotation, node.name);
  if (tissue >= 0) return tissue;
  std::set<std::string> names;
  for (const content::Tissue& t : tissues) names.insert(t.name);
  const std::string close = files::nearest(annotation.preset, names);
  problems.push_back(fmt::format("{}: {} names the tissue \"{}\", which the tissue table does not have{}", place,
                                 node.name, annotation.preset,
                                 close.empty() ? "; add it there" : fmt::format("; did you mean \"{}\"?", close)));
  return 0;
}

void append(mesh::TriangleMesh& to, const mesh::TriangleMesh& from, const Eigen::Affine3d& patient_from_file) {
  const auto base = static_cast<std::uint32_t>(to.vertices.size());
  for (const auto& vertex : from.vertices) to.vertices.push_back(patient_from_file * vertex);
  for (const auto& [a, b, c] : from.triangles) to.triangles.push_back({base + a, base + b, base + c});
}

}  // namespace

std::vector<Organ> build_anatomy(const ScenarioFile& scenario, std::span<const gltf::GltfScene> files,
                                 std::vector<content::Tissue>& tissues, std::vector<std::string>& problems) {
  std::vector<Organ> organs;
  std::map<std::tuple<std::string, int, std::string, int>, std::size_t> known;
  for (std::size_t f = 0; f < files.size(); ++f) {
    const OrganFile& file = scenario.organs[f];
    std::set<std::string> names;
    for (const gltf::GltfOrgan& node : files[f].organs) {
      const std::string place = fmt::format("{}:/{}", file.path.string(), node.place);
      names.insert(node.name);
      gltf::OrganAnnotation annotation = node.organ;
      std::string tissue_name;
      if (const auto entry = file.nodes.find(node.name); entry != file.nodes.end()) {
        annotation = entry->second.organ;
        tissue_name = entry->second.tissue;
        if (annotation.role.empty()) annotation.role = node.organ.role;
        if (annotation.body.empty()) annotation.body = node.organ.body;
      }
      if (annotation.role == "ignore") continue;
      if (annotation.id.empty()) {
        problems.push_back(
            fmt::format("{}: {} has no extras.organ.id; annotate it, or list it in the scenario's "
                        "organs/{}/nodes (role \"ignore\" leaves it out)",
                        place, node.name, f));
        continue;
      }
      const int tissue = resolve_tissue(node, tissue_name, place, tissues, problems);
      const content::SurfaceRole role = role_of(annotation.role);
      const auto [entry, added] =
          known.try_emplace({annotation.id, static_cast<int>(role), annotation.body, tissue}, organs.size());
      if (added) {
        organs.push_back({.id = annotation.id,
                          .name = node.name,
                          .place = place,
                          .body = annotation.body,
                          .role = role,
                          .tissue = tissue,
                          .mesh = {}});
      }
      append(organs[entry->second].mesh, node.mesh, file.patient_from_file);
    }
    for (const auto& [name, override] : file.nodes) {
      if (names.contains(name)) continue;
      const std::string close = files::nearest(name, names);
      problems.push_back(fmt::format("{}:/organs/{}/nodes: {} has no node \"{}\"{}", scenario.path.string(), f,
                                     file.path.filename().string(), name,
                                     close.empty() ? "; remove it" : fmt::format("; did you mean \"{}\"?", close)));
    }
  }
  for (Organ& organ : organs) {
    try {
      // Layers and sheets are thin on purpose; a body to tetrahedralise is demanded to be solid when it is.
      organ.mesh = mesh::clean_surface(organ.mesh, organ.place);
      const mesh::SurfaceReport report = mesh::inspect(organ.mesh);
      if (organ.role != content::SurfaceRole::visual && !report.closed()) {
        problems.push_back(
            fmt::format("{}: {} is not closed: {} open and {} non-manifold edges; close it, add the "
                        "patches that are missing to the organ, or give it the role visual",
                        organ.place, organ.id, report.boundary_edges, report.non_manifold_edges));
      }
    } catch (const files::ContentError& error) {
      problems.emplace_back(error.what());
    }
  }
  return organs;
}

const Organ* find_organ(std::span<const Organ> organs, const std::string& id) {
  const Organ* found = nullptr;
  for (const Organ& organ : organs) {
    if (organ.id == id && (found == nullptr || (found->role != content::SurfaceRole::boundary &&
                                                organ.role == content::SurfaceRole::boundary))) {
      found = &organ;
    }
  }
  return found;
}

}  // namespace stylet::readers
