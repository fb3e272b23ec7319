#include "engine/content/deformable.h"

#include "engine/content/solid.h"
#include "engine/content/tetrahedralise.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace stylet::content {
namespace {

std::vector<int> fixed_nodes(const BodyRequest& request, const physics::TetMesh& mesh, std::span<const Organ> organs,
                             const std::string& scenario, std::vector<std::string>& problems) {
  std::vector<bool> fixed(mesh.nodes.size(), false);
  for (const FixedRegion& region : request.fixed) {
    std::vector<std::unique_ptr<Solid>> near;
    for (const std::string& id : region.near) {
      const Organ* organ = find_organ(organs, id);
      if (organ == nullptr) {
        problems.push_back(
            fmt::format("{}:{}/near: there is no organ \"{}\"; correct its id", scenario, region.pointer, id));
        continue;
      }
      near.push_back(std::make_unique<Solid>(organ->mesh));
    }
    std::size_t held = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
      const Eigen::Vector3d& x = mesh.nodes[n];
      if (region.box && !region.box->contains(x)) continue;
      if (region.outside_box && region.outside_box->contains(x)) continue;
      if (region.plane && region.plane->signedDistance(x) < 0) continue;
      if (!region.near.empty() && std::none_of(near.begin(), near.end(), [&](const auto& solid) {
            return solid->bounds().exteriorDistance(x) <= region.distance &&
                   solid->signed_distance(x) <= region.distance;
          })) {
        continue;
      }
      fixed[n] = true;
      ++held;
    }
    if (held == 0) {
      problems.push_back(
          fmt::format("{}:{}: holds no node of {}; enlarge the region", scenario, region.pointer, request.name));
    }
  }
  std::vector<int> nodes;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (fixed[n]) nodes.push_back(static_cast<int>(n));
  }
  if (nodes.size() < 3) {
    problems.push_back(fmt::format("{}:{}/fixed: holds {} nodes of {}, at least 3 are needed or it floats away",
                                   scenario, request.pointer, nodes.size(), request.name));
  }
  return nodes;
}

std::vector<std::uint8_t> tet_tissues(const BodyRequest& request, const physics::TetMesh& mesh, const Organ& boundary,
                                      std::span<const Organ> organs) {
  struct Region {
    std::uint8_t tissue;
    Solid solid;
  };
  std::vector<Region> regions;
  for (const Organ& organ : organs) {
    if (organ.body != request.name || (organ.role != SurfaceRole::region && organ.role != SurfaceRole::target))
      continue;
    regions.push_back({static_cast<std::uint8_t>(organ.tissue), Solid(organ.mesh)});
  }
  std::vector<std::uint8_t> tissues;
  tissues.reserve(mesh.tets.size());
  for (const auto& tet : mesh.tets) {
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const int node : tet) centroid += 0.25 * mesh.nodes[static_cast<std::size_t>(node)];
    auto tissue = static_cast<std::uint8_t>(boundary.tissue);
    for (auto region = regions.rbegin(); region != regions.rend(); ++region) {
      if (region->solid.bounds().contains(centroid) && region->solid.contains(centroid)) {
        tissue = region->tissue;
        break;
      }
    }
    tissues.push_back(tissue);
  }
  return tissues;
}

}  // namespace

DeformableBody build_body(const BodyRequest& request, std::span<const Organ> organs, const std::string& scenario,
                          std::vector<std::string>& problems) {
  DeformableBody body;
  body.name = request.name;
  const Organ* boundary = find_organ(organs, request.boundary);
  if (boundary == nullptr) {
    problems.push_back(fmt::format("{}:{}/boundary: there is no organ \"{}\" in the organ files; correct its id",
                                   scenario, request.pointer, request.boundary));
    return body;
  }
  try {
    body.mesh = tetrahedralise(
        boundary->mesh, {.cell = request.cell, .target_nodes = request.target_nodes, .where = boundary->place});
  } catch (const ContentError& error) {
    problems.emplace_back(error.what());
    return body;
  }
  body.tet_tissue = tet_tissues(request, body.mesh, *boundary, organs);
  body.fixed_nodes = fixed_nodes(request, body.mesh, organs, scenario, problems);
  return body;
}

}  // namespace stylet::content
