#include "engine/content/deformable.h"

#include "engine/content/solid.h"
#include "engine/content/tetrahedralise.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace stylet::content {
namespace {

/// Fills fixed_nodes and held_motion. Where regions overlap, the later one says how its nodes move.
void hold_nodes(const BodyRequest& request, std::span<const Organ> organs, const std::string& scenario,
                DeformableBody& body, std::vector<std::string>& problems) {
  const physics::TetMesh& mesh = body.mesh;
  std::vector<bool> fixed(mesh.nodes.size(), false);
  std::vector<Eigen::Vector3d> motion(mesh.nodes.size(), Eigen::Vector3d::Zero());
  bool moves = false;
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
      motion[n] = region.breathing;
      ++held;
    }
    moves = moves || !region.breathing.isZero();
    if (held == 0) {
      problems.push_back(
          fmt::format("{}:{}: holds no node of {}; enlarge the region", scenario, region.pointer, request.name));
    }
  }
  std::vector<int>& nodes = body.fixed_nodes;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (!fixed[n]) continue;
    nodes.push_back(static_cast<int>(n));
    if (moves) body.held_motion.push_back(motion[n]);
  }
  if (nodes.size() < 3) {
    problems.push_back(fmt::format("{}:{}/fixed: holds {} nodes of {}, at least 3 are needed or it floats away",
                                   scenario, request.pointer, nodes.size(), request.name));
  }
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
  hold_nodes(request, organs, scenario, body, problems);
  return body;
}

}  // namespace stylet::content
