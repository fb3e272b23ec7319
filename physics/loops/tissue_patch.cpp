#include "physics/loops/tissue_patch.h"

#include "physics/contact/surface_sweep.h"
#include "physics/tissue/refinement.h"

#include <algorithm>
#include <vector>

namespace stylet::physics {
namespace {

/// Place of a value in an ascending list, -1.
int place_in(std::span<const int> list, int value) {
  const auto at = std::lower_bound(list.begin(), list.end(), value);
  return at != list.end() && *at == value ? static_cast<int>(at - list.begin()) : -1;
}

/// What is around a node now: as much stiffer as the law has made the points next to it (eq. 47).
NodeSurroundings surroundings_of(const PatchSource& source, int node) {
  const TissueModel& model = source.model;
  NodeSurroundings around = model.surroundings[node];
  if (source.stiffening.empty()) return around;
  double stiffness = 0;
  double at_rest = 0;
  for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k) {
    const auto t = static_cast<std::size_t>(model.incident_tets[k]);
    const double here = model.tets[t].volume * model.materials[t].young_modulus;
    const std::size_t point = model.is_quadratic() ? 4 * (t / kTetsOfRefined) + t % 4 : t;
    stiffness += here * source.stiffening[point].ratio;
    at_rest += here;
  }
  around.strained = stiffness / at_rest;
  around.material.young_modulus *= around.strained;
  return around;
}

void fill_tets(const PatchSource& source, std::span<const int> nodes, BodyPatch& out, std::uint32_t& flags) {
  const TissueModel& model = source.model;
  out.tet_count = 0;
  for (const int node : nodes) {
    for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k) {
      const int t = model.incident_tets[k];
      const auto& corners = model.topology.nodes(t);
      if (node != *std::min_element(corners.begin(), corners.end())) continue;  // each tetrahedron once
      const bool whole =
          std::all_of(corners.begin(), corners.end(), [&](int corner) { return place_in(nodes, corner) >= 0; });
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
      out.tet_nodes[i][a] = place_in(nodes, corners[a]);
      const int beyond = model.topology.neighbour(ids[i], static_cast<int>(a));
      const int at = beyond < 0 ? kBeyondSurface : place_in(ids, beyond);
      out.tet_neighbours[i][a] = beyond >= 0 && at < 0 ? kBeyondPatch : at;
    }
  }
}

void fill_surface(const PatchSource& source, BodyPatch& out) {
  SurfacePatch& surface = out.surface;
  if (surface.topology == nullptr) return;
  const std::vector<int>& ids = surface.topology->node_ids;
  std::size_t isolated = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    while (isolated < source.nodes.size() && source.nodes[isolated] < ids[i]) ++isolated;
    const bool free = isolated < source.nodes.size() && source.nodes[isolated] == ids[i];
    surface.positions.col(static_cast<Eigen::Index>(i)) =
        free ? source.free_positions.col(static_cast<Eigen::Index>(isolated)) : source.positions.col(ids[i]);
  }
  refit(surface);
}

}  // namespace

void fill_body_patch(const PatchSource& source, BodyPatch& out, std::uint32_t& flags) {
  out.node_count = static_cast<int>(source.nodes.size() + source.held.size());
  const std::span<const int> nodes(out.node_ids.data(), static_cast<std::size_t>(out.node_count));
  std::merge(source.nodes.begin(), source.nodes.end(), source.held.begin(), source.held.end(), out.node_ids.begin());
  Eigen::Index isolated = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const auto next = static_cast<std::size_t>(isolated);
    const bool free = next < source.nodes.size() && source.nodes[next] == nodes[i];
    out.free_positions.col(column) = free ? source.free_positions.col(isolated++) : source.positions.col(nodes[i]);
    out.rest_positions.col(column) = source.model.mesh.nodes[nodes[i]];
    out.surroundings[i] = surroundings_of(source, nodes[i]);
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
  fill_tets(source, nodes, out, flags);
  fill_surface(source, out);
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

}  // namespace stylet::physics
