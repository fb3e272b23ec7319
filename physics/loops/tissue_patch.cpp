#include "physics/loops/tissue_patch.h"

#include "physics/contact/corridor.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace stylet::physics {
namespace {

/// Place of a value in an ascending list, -1.
int place_in(std::span<const int> list, int value) {
  const auto at = std::lower_bound(list.begin(), list.end(), value);
  return at != list.end() && *at == value ? static_cast<int>(at - list.begin()) : -1;
}

void fill_tets(const PatchSource& source, BodyPatch& out, std::uint32_t& flags) {
  const TissueModel& model = source.model;
  out.tet_count = 0;
  for (const int node : source.nodes) {
    for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k) {
      const int t = model.incident_tets[k];
      const auto& corners = model.topology.nodes(t);
      if (node != *std::min_element(corners.begin(), corners.end())) continue;  // each tetrahedron once
      const bool whole = std::all_of(corners.begin(), corners.end(),
                                     [&](int corner) { return place_in(source.nodes, corner) >= 0; });
      if (!whole) continue;
      if (out.tet_count == kMaxPatchTets) {
        flags |= kPatchTetOverflow;
        break;
      }
      out.tet_ids[out.tet_count++] = t;
    }
  }
  const std::span<int> ids(out.tet_ids.data(), static_cast<std::size_t>(out.tet_count));
  std::sort(ids.begin(), ids.end());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto& corners = model.topology.nodes(ids[i]);
    for (std::size_t a = 0; a < 4; ++a) {
      out.tet_nodes[i][a] = place_in(source.nodes, corners[a]);
      const int beyond = model.topology.neighbour(ids[i], static_cast<int>(a));
      const int at = beyond < 0 ? kBeyondSurface : place_in(ids, beyond);
      out.tet_neighbours[i][a] = beyond >= 0 && at < 0 ? kBeyondPatch : at;
    }
  }
}

}  // namespace

void fill_body_patch(const PatchSource& source, BodyPatch& out, std::uint32_t& flags) {
  const std::span<const int> nodes = source.nodes;
  out.node_count = static_cast<int>(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    out.node_ids[i] = nodes[i];
    out.free_positions.col(column) = source.free_positions.col(column);
    out.rest_positions.col(column) = source.model.mesh.nodes[nodes[i]];
    out.surroundings[i] = source.model.surroundings[nodes[i]];
  }

  out.contact_count = 0;
  for (const PathContact& contact : source.contacts) {
    PatchContact& to = out.contacts[out.contact_count++];
    to.id = contact.id;
    to.tet = contact.point.tet;
    for (std::size_t a = 0; a < 4; ++a) to.patch_nodes[a] = place_in(nodes, source.model.topology.nodes(to.tet)[a]);
    to.barycentric = contact.point.barycentric;
    to.beam = contact.beam;
    to.beam_fraction = contact.beam_fraction;
    to.directions = contact.directions;
  }
  fill_tets(source, out, flags);
}

void fill_w_bar(const IsolatedDofs& isolated, BodyPatch& out) {
  if (out.w_bar_values.size() < kMaxWBarValues) out.w_bar_values.assign(kMaxWBarValues, 0.0);
  for (int b = 0; b < out.node_count; ++b) {
    for (int a = 0; a < out.node_count; ++a) {
      const int row = out.node_ids[a];
      const int column = out.node_ids[b];
      if (isolated.known(row) && isolated.known(column)) {
        out.w_bar(a, b) = isolated.block(row, column);
      } else {
        out.w_bar(a, b).setZero();  // a held node
      }
    }
  }
}

void fill_interfaces(std::span<const TissueModel> models, std::span<const Eigen::Matrix3Xd> positions,
                     const NeedleState& needle, double range, TissuePatch& out) {
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const Eigen::Vector3d axis = (tip - needle.positions.col(needle.node_count - 2)).normalized();
  std::vector<PatchInterface> found;
  std::vector<SurfaceCrossing> crossings;
  for (std::size_t b = 0; b < models.size(); ++b) {
    const std::span<const int> tets(out.bodies[b].tet_ids.data(), static_cast<std::size_t>(out.bodies[b].tet_count));
    crossings.clear();
    models[b].topology.crossings(positions[b], tip - kPassed * axis, axis, range + kPassed, crossings);
    for (const SurfaceCrossing& crossing : crossings) {
      found.push_back({.distance_ahead = crossing.distance - kPassed,
                       .normal = crossing.normal,
                       .body = static_cast<int>(b),
                       .entering = crossing.entering,
                       .patch_tet = place_in(tets, crossing.point.tet),
                       .barycentric = crossing.point.barycentric});
    }
  }
  // Not std::stable_sort: the memory that libstdc++ 12 takes for it is not aligned as Eigen's types ask.
  std::sort(found.begin(), found.end(), [](const PatchInterface& a, const PatchInterface& b) {
    return std::tuple(a.distance_ahead, a.body, a.patch_tet) < std::tuple(b.distance_ahead, b.body, b.patch_tet);
  });
  out.interface_count = static_cast<int>(std::min<std::size_t>(found.size(), kMaxPatchInterfaces));
  std::copy_n(found.begin(), out.interface_count, out.interfaces.begin());
}

}  // namespace stylet::physics
