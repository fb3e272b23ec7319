#include "physics/contact/surface_sweep.h"

#include "physics/contact/body_surface.h"
#include "physics/tissue/tet_topology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace stylet::physics {

using Eigen::Vector3d;

namespace {

constexpr int kSweptLeaf = 4;
constexpr int kSweptStack = 64;   // deep enough for 2^32 faces: the tree is balanced
constexpr double kOnEdge = 1e-9;  // of a face: how far a hit may be off it
constexpr double kBegun = 10e-3;  // m; the same of a tip that is inside when tissue is first known; deeper, it stays
constexpr double kWentOn = 1e-3;  // m; a tip that turns round for less has not
constexpr double kFound = 50e-3;  // m; how deep under a surface that came over it a tip may be

struct Corners {
  Vector3d a, b, c;
};

Corners corners_of(const SurfacePatch& surface, int face) {
  const auto& [a, b, c] = surface.topology->faces[face].corners;
  return {surface.positions.col(a), surface.positions.col(b), surface.positions.col(c)};
}

/// Part of a segment at which it comes into a box; more than `most`: not before that.
double box_entry(const Eigen::AlignedBox3d& box, const Vector3d& from, const Vector3d& way, double most) {
  double enter = 0;
  double leave = most;
  for (int d = 0; d < 3; ++d) {
    if (way[d] == 0) {
      if (from[d] < box.min()[d] || from[d] > box.max()[d]) return std::numeric_limits<double>::infinity();
      continue;
    }
    const double s = (box.min()[d] - from[d]) / way[d];
    const double t = (box.max()[d] - from[d]) / way[d];
    enter = std::max(enter, std::min(s, t));
    leave = std::min(leave, std::max(s, t));
  }
  constexpr double kRounding = 1e-12;
  return enter <= leave + kRounding ? enter : std::numeric_limits<double>::infinity();
}

/// Every face but those in boxes that are beyond what is looked for.
/// @param beyond  bool(box)  @param visit  void(face)
template <class Beyond, class Visit>
void visit_faces(const SurfacePatch& surface, const Beyond& beyond, const Visit& visit) {
  const SurfaceTopology& topology = *surface.topology;
  std::array<int, kSweptStack> stack{};
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const int i = stack[--depth];
    if (beyond(surface.boxes[i])) continue;
    const SurfaceTopology::Box& node = topology.tree[i];
    if (node.left >= 0) {
      stack[depth++] = node.left + 1;
      stack[depth++] = node.left;
      continue;
    }
    for (int f = node.first; f < node.first + node.count; ++f) visit(f);
  }
}

}  // namespace

SurfaceTopology surface_topology(const TissueModel& model) {
  SurfaceTopology surface;
  std::vector<int> place(model.mesh.nodes.size(), -1);
  for (int t = 0; t < model.tet_count(); ++t) {
    const auto& nodes = model.topology.nodes(t);
    for (int f = 0; f < 4; ++f) {
      if (model.topology.neighbour(t, f) >= 0) continue;
      SurfaceTopology::Face face{.tet = t, .apex = f, .tet_nodes = nodes};
      for (std::size_t c = 0; c < 3; ++c) {
        face.corners[c] = nodes[kFaceCorners[f][c]];
        place[face.corners[c]] = 0;
      }
      surface.faces.push_back(face);
    }
  }
  for (int n = 0; n < model.node_count(); ++n) {
    if (place[n] < 0) continue;
    place[n] = static_cast<int>(surface.node_ids.size());
    surface.node_ids.push_back(n);
    surface.surroundings.push_back(model.surroundings[n]);
  }
  surface.rest_positions.resize(3, static_cast<Eigen::Index>(surface.node_ids.size()));
  for (std::size_t i = 0; i < surface.node_ids.size(); ++i) {
    surface.rest_positions.col(static_cast<Eigen::Index>(i)) = model.mesh.nodes[surface.node_ids[i]];
  }
  for (auto& face : surface.faces) {
    for (int& corner : face.corners) corner = place[corner];
  }

  const auto centre = [&](const SurfaceTopology::Face& face) -> Vector3d {
    const auto& [a, b, c] = face.corners;
    return surface.rest_positions.col(a) + surface.rest_positions.col(b) + surface.rest_positions.col(c);
  };
  surface.tree.push_back({.left = -1, .first = 0, .count = static_cast<int>(surface.faces.size())});
  for (std::size_t i = 0; i < surface.tree.size(); ++i) {
    const auto [left, first, count] = surface.tree[i];
    if (count <= kSweptLeaf) continue;
    const auto begin = surface.faces.begin() + first;
    Eigen::AlignedBox3d extent;
    std::for_each(begin, begin + count, [&](const auto& face) { extent.extend(centre(face)); });
    int axis = 0;
    extent.sizes().maxCoeff(&axis);
    const int half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](const auto& a, const auto& b) {
      return std::tuple(centre(a)[axis], a.tet, a.apex) < std::tuple(centre(b)[axis], b.tet, b.apex);
    });
    surface.tree[i].left = static_cast<int>(surface.tree.size());
    surface.tree.push_back({.left = -1, .first = first, .count = half});
    surface.tree.push_back({.left = -1, .first = first + half, .count = count - half});
  }
  return surface;
}

void refit(SurfacePatch& surface) {
  const SurfaceTopology& topology = *surface.topology;
  for (std::size_t i = topology.tree.size(); i-- > 0;) {
    const SurfaceTopology::Box& node = topology.tree[i];
    Eigen::AlignedBox3d& box = surface.boxes[i];
    if (node.left >= 0) {
      box = surface.boxes[node.left].merged(surface.boxes[static_cast<std::size_t>(node.left) + 1]);
      continue;
    }
    box.setEmpty();
    for (int f = node.first; f < node.first + node.count; ++f) {
      for (const int corner : topology.faces[f].corners) box.extend(surface.positions.col(corner));
    }
  }
}

SurfaceHit first_hit(const SurfacePatch& surface, const Vector3d& from, const Vector3d& to) {
  const Vector3d way = to - from;
  SurfaceHit best;
  best.along = 1;
  const auto beyond = [&](const Eigen::AlignedBox3d& box) {
    return box_entry(box, from, way, best.along) > best.along;
  };
  visit_faces(surface, beyond, [&](int f) {
    // Moeller and Trumbore 1997
    const auto [a, b, c] = corners_of(surface, f);
    const Vector3d ab = b - a;
    const Vector3d ac = c - a;
    const Vector3d p = way.cross(ac);
    const double determinant = ab.dot(p);  // positive: against the outward normal
    if (determinant == 0) return;
    const Vector3d q = (from - a).cross(ab);
    const double u = (from - a).dot(p) / determinant;
    const double v = way.dot(q) / determinant;
    const double along = ac.dot(q) / determinant;
    if (!(u >= -kOnEdge && v >= -kOnEdge && u + v <= 1 + kOnEdge && along >= 0 && along <= best.along)) return;
    if (along == best.along && best.face >= 0) return;
    const Vector3d weights = Vector3d(1 - u - v, u, v).cwiseMax(0.0);
    best = {.face = f, .weights = weights / weights.sum(), .along = along, .entering = determinant > 0};
  });
  return best;
}

SurfaceHit nearest(const SurfacePatch& surface, const Vector3d& x, double range) {
  SurfaceHit best;
  double best_squared = range * range;
  const auto beyond = [&](const Eigen::AlignedBox3d& box) { return box.squaredExteriorDistance(x) > best_squared; };
  visit_faces(surface, beyond, [&](int f) {
    const auto [a, b, c] = corners_of(surface, f);
    const Vector3d weights = closest_weights(x, a, b, c);
    const double squared = (x - weights[0] * a - weights[1] * b - weights[2] * c).squaredNorm();
    if (squared >= best_squared) return;
    best_squared = squared;
    best = {.face = f, .weights = weights, .along = 0, .entering = true};
  });
  return best;
}

bool is_inside(const SurfacePatch& surface, const Vector3d& x, const Vector3d& direction) {
  const Eigen::AlignedBox3d& bounds = surface.boxes.front();
  if (!bounds.contains(x)) return false;
  const SurfaceHit out = first_hit(surface, x, x - bounds.diagonal().norm() * direction);
  return out.face >= 0 && !out.entering;
}

Vector3d position_on(const SurfacePatch& surface, const SurfaceHit& hit) {
  const auto [a, b, c] = corners_of(surface, hit.face);
  return hit.weights[0] * a + hit.weights[1] * b + hit.weights[2] * c;
}

Vector3d normal_on(const SurfacePatch& surface, const SurfaceHit& hit) {
  const auto [a, b, c] = corners_of(surface, hit.face);
  return (b - a).cross(c - a).normalized();
}

void SurfaceSweep::enter(Body& body, const SurfaceHit& hit) {
  body.hit = hit;
  body.order = ++entries_;
}

void SurfaceSweep::leave(Body& body) {
  late_ = late_ || body.late;
  body.hit = {};
  body.late = false;
  body.began_inside = body.passed_over = false;
  body.went_on = 0;
}

void SurfaceSweep::follow(const TissuePatch& patch, const Vector3d& tip, const Vector3d& tangent,
                          const std::array<bool, kMaxBodies>& watched, bool held_up) {
  const bool fresh = patch.epoch != epoch_;
  epoch_ = patch.epoch;
  for (int b = 0; b < kMaxBodies; ++b) {
    Body& body = bodies_[b];
    if (b >= patch.body_count || patch.bodies[b].surface.topology == nullptr) {
      body = {};
      continue;
    }
    const SurfacePatch& surface = patch.bodies[b].surface;
    const Vector3d from = body.known ? body.from : tip;
    body.from = tip;
    body.way = (tip - from).norm();
    if (body.passed_over) body.went_on = std::max(0.0, body.went_on + (tip - from).dot(tangent));
    if (!watched[b]) {
      body = {.known = true, .watched = false, .from = tip};
      continue;
    }
    if (!body.known) {
      body.known = body.watched = true;
      if (!is_inside(surface, tip, tangent)) continue;
      const SurfaceHit near = nearest(surface, tip, kBegun);
      body.began_inside = near.face < 0;
      if (!body.began_inside) enter(body, near);
      continue;
    }
    // The last crossing of the way says where the tip is now: searched from the tip back.
    const SurfaceHit last = from != tip ? first_hit(surface, tip, from) : SurfaceHit{};
    const bool inside_before = body.hit.face >= 0;
    if (last.face >= 0) {
      const bool in = !last.entering;  // on the way back it is left where it was entered
      if (in && !inside_before) enter(body, last);
      if (!in) leave(body);
    } else if (fresh || !body.watched) {
      const bool in = is_inside(surface, tip, tangent);
      if (!in) leave(body);
      if (in && !inside_before && !body.began_inside) enter(body, nearest(surface, tip, kFound));
    }
    body.watched = true;
    body.late = body.hit.face >= 0 && (body.late || held_up);
  }
}

void SurfaceSweep::start_from(int body, const Vector3d& tip) {
  bodies_[body] = {.known = true, .watched = true, .from = tip};
}

void SurfaceSweep::clear() {
  bodies_ = {};
  epoch_ = 0;
  late_ = false;
}

int SurfaceSweep::went_on() const {
  const auto found = std::find_if(bodies_.begin(), bodies_.end(),
                                  [](const Body& body) { return body.passed_over && body.went_on > kWentOn; });
  return found != bodies_.end() ? static_cast<int>(found - bodies_.begin()) : -1;
}

int SurfaceSweep::entered() const {
  int first = -1;
  for (int b = 0; b < kMaxBodies; ++b) {
    if (bodies_[b].hit.face >= 0 && (first < 0 || bodies_[b].order < bodies_[first].order)) first = b;
  }
  return first;
}

}  // namespace stylet::physics
