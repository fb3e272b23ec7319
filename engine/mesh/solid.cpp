#include "engine/mesh/solid.h"

#include "engine/mesh/nearest_on_triangle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace stylet::mesh {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;

}  // namespace

Solid::Solid(TriangleMesh surface, const files::Pulse& pulse) : surface_(std::move(surface)) {
  const std::size_t count = surface_.triangles.size();
  vertex_normals_.assign(surface_.vertices.size(), Eigen::Vector3d::Zero());
  edge_normals_.resize(count);
  std::vector<Eigen::AlignedBox3d> boxes(count);
  struct EdgeUse {
    std::uint32_t low, high, triangle;
    int edge;
  };
  std::vector<EdgeUse> edges;
  edges.reserve(3 * count);
  std::vector<Eigen::Vector3d> face_normals(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    pulse(4);
    const auto& v = surface_.triangles[t];
    const std::array<Eigen::Vector3d, 3> x{surface_.vertices[v[0]], surface_.vertices[v[1]], surface_.vertices[v[2]]};
    face_normals[t] = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    for (int i = 0; i < 3; ++i) {
      boxes[t].extend(x[i]);
      const Eigen::Vector3d to_next = (x[(i + 1) % 3] - x[i]).stableNormalized();
      const Eigen::Vector3d to_last = (x[(i + 2) % 3] - x[i]).stableNormalized();
      vertex_normals_[v[i]] += face_normals[t] * std::acos(std::clamp(to_next.dot(to_last), -1.0, 1.0));
      const std::uint32_t w = v[(i + 1) % 3];
      edges.push_back({std::min(v[i], w), std::max(v[i], w), t, i});
    }
  }
  for (Eigen::Vector3d& n : vertex_normals_) n.stableNormalize();
  std::sort(edges.begin(), edges.end(), [&](const EdgeUse& a, const EdgeUse& b) {
    pulse();
    return std::array{a.low, a.high, a.triangle} < std::array{b.low, b.high, b.triangle};
  });
  for (std::size_t first = 0; first < edges.size();) {
    pulse();
    std::size_t last = first;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (; last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high;
         ++last) {
      sum += face_normals[edges[last].triangle];
    }
    for (; first < last; ++first) edge_normals_[edges[first].triangle][edges[first].edge] = sum.stableNormalized();
  }

  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.reserve(count);
  build(0, static_cast<std::uint32_t>(count), boxes, pulse);
}

std::uint32_t Solid::build(std::uint32_t first, std::uint32_t count, const std::vector<Eigen::AlignedBox3d>& boxes,
                           const files::Pulse& pulse) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Eigen::AlignedBox3d box;
  Eigen::AlignedBox3d centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    pulse();
    box.extend(boxes[order_[i]]);
    centres.extend(boxes[order_[i]].center());
  }
  nodes_[index].box = box;
  if (count <= kLeafTriangles) {
    nodes_[index].first = first;
    nodes_[index].count = count;
    return index;
  }
  // Median split on the longest axis of the centres; ties by triangle number keep the tree the same everywhere.
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = boxes[a].center()[axis];
    const double cb = boxes[b].center()[axis];
    return ca != cb ? ca < cb : a < b;
  });
  build(first, half, boxes, pulse);
  const std::uint32_t right = build(first + half, count - half, boxes, pulse);
  nodes_[index].first = right;
  return index;
}

Solid::Nearest Solid::nearest(const Eigen::Vector3d& point) const {
  double best = std::numeric_limits<double>::infinity();
  TrianglePoint hit{point, TriangleFeature::face, 0};
  std::uint32_t triangle = 0;
  std::array<std::uint32_t, 64> stack;  // depth of a median-split tree: log2 of the triangles
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::uint32_t index = stack[--top];
    const Node& node = nodes_[index];
    if (node.box.squaredExteriorDistance(point) >= best) continue;
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const auto& v = surface_.triangles[order_[i]];
        const TrianglePoint candidate =
            nearest_on_triangle(point, surface_.vertices[v[0]], surface_.vertices[v[1]], surface_.vertices[v[2]]);
        const double distance2 = (candidate.point - point).squaredNorm();
        if (distance2 < best) {
          best = distance2;
          hit = candidate;
          triangle = order_[i];
        }
      }
      continue;
    }
    const std::uint32_t left = index + 1;
    const double to_left = nodes_[left].box.squaredExteriorDistance(point);
    const double to_right = nodes_[node.first].box.squaredExteriorDistance(point);
    // The nearer child is looked at first, so it is pushed last.
    stack[top++] = to_left <= to_right ? node.first : left;
    stack[top++] = to_left <= to_right ? left : node.first;
  }
  const auto& v = surface_.triangles[triangle];
  Nearest nearest{hit.point, Eigen::Vector3d::Zero(), triangle, std::sqrt(best)};
  switch (hit.feature) {
    case TriangleFeature::face:
      nearest.normal = (surface_.vertices[v[1]] - surface_.vertices[v[0]])
                           .cross(surface_.vertices[v[2]] - surface_.vertices[v[0]])
                           .stableNormalized();
      break;
    case TriangleFeature::edge:
      nearest.normal = edge_normals_[triangle][hit.index];
      break;
    case TriangleFeature::vertex:
      nearest.normal = vertex_normals_[v[hit.index]];
      break;
  }
  return nearest;
}

double Solid::signed_distance(const Eigen::Vector3d& point) const {
  const Nearest hit = nearest(point);
  return (point - hit.point).dot(hit.normal) < 0 ? -hit.distance : hit.distance;
}

int Solid::crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d direction = to - from;
  const auto hits_box = [&](const Eigen::AlignedBox3d& box) {
    double near = 0;
    double far = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] == 0) {
        if (from[axis] < box.min()[axis] || from[axis] > box.max()[axis]) return false;
        continue;
      }
      double enter = (box.min()[axis] - from[axis]) / direction[axis];
      double leave = (box.max()[axis] - from[axis]) / direction[axis];
      if (enter > leave) std::swap(enter, leave);
      near = std::max(near, enter);
      far = std::min(far, leave);
    }
    return near <= far;
  };
  int count = 0;
  std::array<std::uint32_t, 64> stack;
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::uint32_t index = stack[--top];
    const Node& node = nodes_[index];
    if (!hits_box(node.box)) continue;
    if (node.count == 0) {
      stack[top++] = node.first;
      stack[top++] = index + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {  // Moeller and Trumbore
      const auto& v = surface_.triangles[order_[i]];
      const Eigen::Vector3d ab = surface_.vertices[v[1]] - surface_.vertices[v[0]];
      const Eigen::Vector3d ac = surface_.vertices[v[2]] - surface_.vertices[v[0]];
      const Eigen::Vector3d h = direction.cross(ac);
      const double determinant = ab.dot(h);
      if (determinant == 0) continue;
      const Eigen::Vector3d s = from - surface_.vertices[v[0]];
      const double u = s.dot(h) / determinant;
      const Eigen::Vector3d q = s.cross(ab);
      const double w = direction.dot(q) / determinant;
      const double t = ac.dot(q) / determinant;
      if (u >= 0 && w >= 0 && u + w <= 1 && t >= 0 && t <= 1) ++count;
    }
  }
  return count;
}

}  // namespace stylet::mesh
