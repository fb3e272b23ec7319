#include "physics/contact/corridor.h"

#include <algorithm>
#include <optional>

namespace stylet::physics {
namespace {

constexpr double kStride = 0.5e-3;  // m along the line: less than a tetrahedron, a flat one too
constexpr double kNear = 12e-3;     // m ahead of the tip; further on a flat one may be missed for a step
constexpr double kFar = 2e-3;       // m; the same there, and outside, where the surface is not quite where it was
constexpr int kMostOutside = 3;     // such strides before the first one inside
// A tip that has gone into a body by less than this is still found where it did: it goes on while a patch is made.
constexpr double kPassed = 60e-3;  // m

/// Distinct nodes in the order they came.
class NodeList {
public:
  NodeList(const TissueModel& model, std::size_t most)
      : model_(model), most_(most), known_(model.mesh.nodes.size()) {}
  void add(int tet) {
    if (tet < 0) return;
    for (const int node : model_.topology.nodes(tet)) {
      if (known_[node] || nodes_.size() == most_) continue;
      known_[node] = true;
      nodes_.push_back(node);
    }
  }
  void add_with_neighbours(int tet, int rings) {
    if (tet < 0) return;
    add(tet);
    if (rings == 0) return;
    for (int face = 0; face < 4; ++face) add_with_neighbours(model_.topology.neighbour(tet, face), rings - 1);
  }
  /// With every tetrahedron that shares a node.
  void add_around(int tet) {
    add(tet);
    for (const int node : model_.topology.nodes(tet)) {
      for (int k = model_.incident_start[node]; k < model_.incident_start[node + 1]; ++k)
        add(model_.incident_tets[k]);
    }
  }
  std::vector<int> take() { return std::move(nodes_); }

private:
  const TissueModel& model_;
  std::size_t most_;
  std::vector<bool> known_;
  std::vector<int> nodes_;
};

}  // namespace

std::vector<int> corridor_nodes(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                const NeedleState& needle, int body, double range, std::size_t most) {
  NodeList nodes(model, most);
  // What is dented springs back sideways, too, when it gives way.
  const int rings = needle.tip == TipState::indenting ? 2 : 1;
  int hint = -1;  // the end of the track, if it is in this body
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  for (int i = 0; i < needle.track_count; ++i) {
    const NeedleContact& contact = needle.contacts[i];
    if (contact.body != body || contact.tet < 0 || contact.tet >= model.tet_count()) continue;
    nodes.add_with_neighbours(contact.tet, contact.cuts ? 1 : 0);
    if (contact.id != 0) continue;
    hint = contact.tet;
    end = contact.position;
  }
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const Eigen::Vector3d axis = (tip - needle.positions.col(needle.node_count - 2)).normalized();
  double s = 0;
  if (hint >= 0) {
    nodes.add_with_neighbours(hint, rings);
    // The needle may have gone on since the track's end was known: from there to the tip, too.
    s = std::min(0.0, (end - tip).dot(axis));
    if (needle.tip == TipState::indenting) s += kFar;  // it is on the surface
  }
  if (hint < 0) {
    std::vector<SurfaceCrossing> crossings;
    model.topology.crossings(positions, tip - kPassed * axis, axis, std::max(range, kPassed) + kPassed, crossings);
    const SurfaceCrossing* entry = nullptr;
    const SurfaceCrossing* exit = nullptr;  // the first crossing ahead of the tip, where that is in the body
    for (const SurfaceCrossing& crossing : crossings) {
      if (crossing.distance >= kPassed && exit == nullptr && !crossing.entering) exit = &crossing;
      if (crossing.distance > range + kPassed || (crossing.distance >= kPassed && exit != nullptr)) break;
      if (crossing.entering && entry == nullptr) entry = &crossing;
      if (!crossing.entering && crossing.distance < kPassed) entry = nullptr;  // it lies behind the tip
    }
    if (entry != nullptr) {
      nodes.add_around(entry->point.tet);  // the hand may meet the surface beside it
      hint = entry->point.tet;
      s = entry->distance - kPassed + kStride;
    } else if (exit != nullptr) {  // it came in by another way than the needle points
      hint = exit->point.tet;
    } else {
      return nodes.take();
    }
  }
  int outside = 0;
  std::optional<double> before;  // of s
  bool inside = false;           // there
  while (s <= range) {
    const Eigen::Vector3d x = tip + s * axis;
    const TetPoint point = before ? model.topology.follow(positions, tip + *before * axis, inside, x, hint)
                                  : model.topology.locate(positions, x, hint);
    before = s;
    inside = point.tet >= 0;
    if (!inside) {
      if (++outside > kMostOutside) break;
      s += kFar;
      continue;
    }
    outside = kMostOutside;
    nodes.add_with_neighbours(point.tet, rings);
    hint = point.tet;
    s += s < kNear ? kStride : kFar;
  }
  return nodes.take();
}

std::vector<int> nodes_around(const TissueModel& model, std::span<const int> nodes, std::size_t most) {
  NodeList around(model, most);
  for (const int node : nodes) {
    for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k)
      around.add(model.incident_tets[k]);
  }
  return around.take();
}

double dent(const TissueModel& model, const NeedleState& needle, int body) {
  if (needle.tip != TipState::indenting || needle.tip_body != body || needle.track_count == 0) return 0;
  const NeedleContact& end = needle.contacts[needle.track_count - 1];
  if (end.id != 0 || end.body != body || end.tet < 0 || end.tet >= model.tet_count()) return 0;
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    rest += end.barycentric[static_cast<Eigen::Index>(k)] * model.mesh.nodes[model.topology.nodes(end.tet)[k]];
  }
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const Eigen::Vector3d axis = (tip - needle.positions.col(needle.node_count - 2)).normalized();
  return std::max(0.0, (tip - rest).dot(axis));
}

}  // namespace stylet::physics
