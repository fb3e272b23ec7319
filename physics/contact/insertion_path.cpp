#include "physics/contact/insertion_path.h"

#include "physics/contact/shaft.h"

#include <algorithm>
#include <utility>

namespace stylet::physics {

/// A straight-edge shaft, by arc length.
struct InsertionPath::Shaft {
  explicit Shaft(Eigen::Matrix3Xd shaft_nodes) : nodes(std::move(shaft_nodes)) {
    start.push_back(0);
    for (Eigen::Index i = 0; i + 1 < nodes.cols(); ++i)
      start.push_back(start.back() + (nodes.col(i + 1) - nodes.col(i)).norm());
  }
  int beams() const { return static_cast<int>(start.size()) - 1; }
  double length() const { return start.back(); }
  double edge_length(int beam) const { return start[static_cast<std::size_t>(beam) + 1] - start[beam]; }
  /// Arc length of a projected point; beyond the tip it goes on along the last edge.
  double arc_length(const ShaftPoint& point, const Eigen::Vector3d& projected) const {
    if (point.ahead_of_tip) return length() + (projected - nodes.col(beams())).dot(point.tangent);
    return start[point.beam] + point.beam_fraction * edge_length(point.beam);
  }
  Eigen::Vector3d at(double s) const {
    const auto above = std::upper_bound(start.begin() + 1, start.end() - 1, s);
    const auto beam = static_cast<Eigen::Index>(above - start.begin() - 1);
    const double edge = edge_length(static_cast<int>(beam));
    const double fraction = edge > 0 ? (s - start[beam]) / edge : 0;
    return nodes.col(beam) + fraction * (nodes.col(beam + 1) - nodes.col(beam));
  }

  Eigen::Matrix3Xd nodes;
  std::vector<double> start;  // arc length at each node
};

InsertionPath::InsertionPath(std::span<const TissueModel> models, const InsertionPathSettings& settings)
    : models_(models), settings_(settings), contacts_(models.size()) {}

void InsertionPath::clear() {
  for (auto& contacts : contacts_) contacts.clear();
}

int InsertionPath::contact_count() const {
  std::size_t count = 0;
  for (const auto& contacts : contacts_) count += contacts.size();
  return static_cast<int>(count);
}

std::vector<int> InsertionPath::isolated_nodes(int body) const {
  std::vector<int> nodes;
  for (const PathContact& contact : contacts_[body]) {
    const auto& tet = models_[body].topology.nodes(contact.point.tet);
    nodes.insert(nodes.end(), tet.begin(), tet.end());
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<int> InsertionPath::nodes_ahead(int body, const NeedleState& needle, const Eigen::Matrix3Xd& positions,
                                            double range) const {
  const auto& contacts = contacts_[body];
  const TetTopology& topology = models_[body].topology;
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  const Eigen::Vector3d axis = (tip - needle.positions.col(needle.node_count - 2)).normalized();
  Eigen::Matrix3Xd nodes(3, needle.node_count + 1);
  nodes << needle.positions.leftCols(needle.node_count), tip + range * axis;
  const Shaft shaft(std::move(nodes));

  double s = 0;
  TetPoint point;
  if (!contacts.empty()) {
    const Eigen::Vector3d x = topology.position(positions, contacts.back().point);
    s = shaft.arc_length(project_on_shaft(shaft.nodes, x), x) + settings_.spacing;
    point = contacts.back().point;
  } else {
    std::vector<SurfaceCrossing> crossings;
    topology.crossings(positions, tip, axis, range, crossings);
    const auto entry =
        std::find_if(crossings.begin(), crossings.end(), [](const SurfaceCrossing& c) { return c.entering; });
    if (entry == crossings.end()) return {};
    s = shaft.length() - range + entry->distance;
    point = entry->point;
  }

  const std::vector<int> isolated = isolated_nodes(body);
  std::vector<int> ahead;
  const auto add = [&](int tet) {
    if (tet < 0) return;
    for (const int node : topology.nodes(tet)) {
      if (std::binary_search(isolated.begin(), isolated.end(), node)) continue;
      if (std::find(ahead.begin(), ahead.end(), node) == ahead.end()) ahead.push_back(node);
    }
  };
  const auto add_with_neighbours = [&](int tet) {  // the needle bends, the tissue gives way: not quite there
    add(tet);
    for (int face = 0; face < 4; ++face) add(topology.neighbour(tet, face));
  };
  if (contacts.empty()) {
    add_with_neighbours(point.tet);
    s += settings_.spacing;
  }
  for (; s <= shaft.length(); s += settings_.spacing) {
    point = topology.locate(positions, shaft.at(s), point.tet);
    if (point.tet < 0) break;  // out of the body: looking for a way back in costs more than it saves
    add_with_neighbours(point.tet);
  }
  return ahead;
}

std::uint32_t InsertionPath::update(const NeedleState& needle, std::span<const Eigen::Matrix3Xd> positions) {
  std::uint32_t flags = 0;
  const Shaft shaft(needle.positions.leftCols(needle.node_count));
  for (std::size_t b = 0; b < models_.size(); ++b) {
    remove_withdrawn(shaft, positions[b], b);
    if (contacts_[b].empty()) flags |= lay_entry(shaft, positions[b], b);
    if (!contacts_[b].empty()) flags |= lay_behind_tip(shaft, positions[b], b);
    while (isolated_nodes(static_cast<int>(b)).size() > kMaxPatchNodes) {
      contacts_[b].erase(contacts_[b].begin());
      flags |= kPatchNodeOverflow;
    }
    for (PathContact& contact : contacts_[b]) {
      const ShaftPoint at = project_on_shaft(shaft.nodes, models_[b].topology.position(positions[b], contact.point));
      contact.beam = at.beam;
      contact.beam_fraction = std::clamp(at.beam_fraction, 0.0, 1.0);
      contact.directions = lateral_directions(at.tangent, needle.orientations[at.beam]);
    }
  }
  return flags;
}

void InsertionPath::remove_withdrawn(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body) {
  auto& contacts = contacts_[body];
  while (!contacts.empty()) {
    const Eigen::Vector3d x = models_[body].topology.position(positions, contacts.back().point);
    const double s = shaft.arc_length(project_on_shaft(shaft.nodes, x), x);
    if (s <= shaft.length() + settings_.removal_hysteresis) break;
    contacts.pop_back();
  }
}

std::uint32_t InsertionPath::lay_entry(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body) {
  std::vector<SurfaceCrossing> crossings;
  for (int beam = 0; beam < shaft.beams(); ++beam) {
    const double edge = shaft.edge_length(beam);
    if (!(edge > 0)) continue;
    const Eigen::Vector3d tangent = (shaft.nodes.col(beam + 1) - shaft.nodes.col(beam)) / edge;
    crossings.clear();
    models_[body].topology.crossings(positions, shaft.nodes.col(beam), tangent, edge, crossings);
    for (const SurfaceCrossing& crossing : crossings) {
      if (crossing.entering) return lay(crossing.point, body);
    }
  }
  return 0;
}

std::uint32_t InsertionPath::lay_behind_tip(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body) {
  std::uint32_t flags = 0;
  const TetTopology& topology = models_[body].topology;
  const PathContact last = contacts_[body].back();
  const Eigen::Vector3d x = topology.position(positions, last.point);
  int hint = last.point.tet;
  for (double s = shaft.arc_length(project_on_shaft(shaft.nodes, x), x) + settings_.spacing; s <= shaft.length();
       s += settings_.spacing) {
    const TetPoint point = topology.locate(positions, shaft.at(s), hint);
    if (point.tet < 0) continue;  // the shaft has left the body; it may come back
    flags |= lay(point, body);
    hint = point.tet;
  }
  return flags;
}

std::uint32_t InsertionPath::lay(const TetPoint& point, std::size_t body) {
  std::uint32_t flags = 0;
  auto& contacts = contacts_[body];
  if (contact_count() >= kMaxContacts) {
    flags = kPatchContactOverflow;
    if (contacts.empty()) return flags;
    contacts.pop_back();
  }
  PathContact contact;
  contact.id = next_id_++;
  contact.point = point;
  contacts.push_back(contact);
  return flags;
}

}  // namespace stylet::physics
