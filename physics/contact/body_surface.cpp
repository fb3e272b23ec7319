#include "physics/contact/body_surface.h"

#include "physics/tissue/tet_topology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace stylet::physics {
namespace {

constexpr int kLeafFaces = 4;
constexpr double kSmooth = 0.64;  // cosine between faces that share a corner: beyond 50 degrees it is a crease
constexpr int kStack = 64;        // deep enough for 2^32 faces: the tree is balanced

/// The least v . facing of all v in the box.
double against(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& facing) {
  return box.min().cwiseProduct(facing).cwiseMin(box.max().cwiseProduct(facing)).sum();
}

}  // namespace

Eigen::Vector3d closest_weights(const Eigen::Vector3d& x, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const double d1 = ab.dot(x - a), d2 = ac.dot(x - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(x - b), d4 = ac.dot(x - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = ab.dot(x - c), d6 = ac.dot(x - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  if (!(sum > 0)) return {1, 0, 0};  // a degenerate triangle
  return {va / sum, vb / sum, vc / sum};
}

BodySurface::BodySurface(const TissueModel& model)
    : positions_(rest_positions(model)), around_start_(model.mesh.nodes.size() + 1, 0) {
  std::vector<char> on_surface(model.mesh.nodes.size(), 0);
  for (int t = 0; t < model.tet_count(); ++t) {
    const auto& corners = model.topology.nodes(t);
    for (int f = 0; f < 4; ++f) {
      if (model.topology.neighbour(t, f) >= 0) continue;
      std::array<int, 3> face{};
      for (std::size_t c = 0; c < 3; ++c) {
        face[c] = corners[kFaceCorners[f][c]];
        on_surface[face[c]] = 1;
      }
      faces_.push_back(face);
    }
  }
  for (std::size_t n = 0; n < on_surface.size(); ++n) {
    if (on_surface[n] != 0) nodes_.push_back(static_cast<int>(n));
  }
  for (const auto& face : faces_) {
    for (const int n : face) ++around_start_[static_cast<std::size_t>(n) + 1];
  }
  std::partial_sum(around_start_.begin(), around_start_.end(), around_start_.begin());
  around_.resize(3 * faces_.size());
  std::vector<int> next(around_start_.begin(), around_start_.end() - 1);
  for (int f = 0; f < face_count(); ++f) {
    for (const int n : face(f)) around_[next[n]++] = f;
  }
  face_areas_.resize(3, static_cast<Eigen::Index>(faces_.size()));
  in_memory_ = nodes_;
  sort_nodes(positions_);
  build_tree(positions_);
  update(rest_positions(model));
  for (Eigen::Index f = 0; f < face_areas_.cols(); ++f) rest_areas_.push_back(face_areas_.col(f).norm() / 2);
  find_smooth_patches();
}

void BodySurface::find_smooth_patches() {
  smooth_start_.push_back(0);
  for (int f = 0; f < face_count(); ++f) {
    const Eigen::Vector3d normal = face_areas_.col(f).normalized();
    for (const int n : face(f)) {
      const std::span around = std::span(around_).subspan(around_start_[n], around_start_[n + 1] - around_start_[n]);
      for (const int g : around) {
        if (normal.dot(face_areas_.col(g).normalized()) > kSmooth || g == f) smooth_faces_.push_back(g);
      }
      const std::size_t smooth = smooth_faces_.size() - static_cast<std::size_t>(smooth_start_.back());
      creased_.push_back(smooth < around.size() ? 1 : 0);
      smooth_start_.push_back(static_cast<int>(smooth_faces_.size()));
    }
  }
}

void BodySurface::sort_nodes(const Eigen::Matrix3Xd& rest) {
  std::vector<double> nearest(nodes_.size(), std::numeric_limits<double>::max());
  for (std::size_t i = 0; i + 1 < nodes_.size(); ++i) {
    std::size_t farthest = i + 1;
    for (std::size_t j = i + 1; j < nodes_.size(); ++j) {
      nearest[j] = std::min(nearest[j], (rest.col(nodes_[j]) - rest.col(nodes_[i])).squaredNorm());
      if (nearest[j] > nearest[farthest]) farthest = j;
    }
    std::swap(nodes_[i + 1], nodes_[farthest]);
    std::swap(nearest[i + 1], nearest[farthest]);
  }
}

void BodySurface::build_tree(const Eigen::Matrix3Xd& rest) {
  order_.resize(faces_.size());
  std::iota(order_.begin(), order_.end(), 0);
  Eigen::Matrix3Xd centres(3, static_cast<Eigen::Index>(faces_.size()));
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto& [a, b, c] = faces_[f];
    centres.col(static_cast<Eigen::Index>(f)) = (rest.col(a) + rest.col(b) + rest.col(c)) / 3;
  }
  boxes_.push_back({.box = {}, .areas = {}, .left = -1, .first = 0, .count = face_count()});
  for (std::size_t i = 0; i < boxes_.size(); ++i) {  // breadth first: children come after their parents
    const int first = boxes_[i].first;
    const int count = boxes_[i].count;
    if (count <= kLeafFaces) continue;
    Eigen::AlignedBox3d extent;
    for (int k = first; k < first + count; ++k) extent.extend(centres.col(order_[k]));
    int axis = 0;
    extent.sizes().maxCoeff(&axis);
    const int half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                     [&](int a, int b) {
                       return centres(axis, a) != centres(axis, b) ? centres(axis, a) < centres(axis, b) : a < b;
                     });
    boxes_[i].left = static_cast<int>(boxes_.size());
    boxes_.push_back({.box = {}, .areas = {}, .left = -1, .first = first, .count = half});
    boxes_.push_back({.box = {}, .areas = {}, .left = -1, .first = first + half, .count = count - half});
  }
}

void BodySurface::update(const Eigen::Matrix3Xd& positions, Companion* companion) {
  double longest = 0;  // squared
  for (const int n : in_memory_) {
    longest = std::max(longest, (positions.col(n) - positions_.col(n)).squaredNorm());
    positions_.col(n) = positions.col(n);
  }
  travel_ += std::sqrt(longest);
  in_parts(boxes_.size() < kBoxesWorthSharing ? nullptr : companion, kSharedParts, [&](int part) {
    const auto [begin, end] = part_of(boxes_.size(), part);
    for (std::size_t i = begin; i < end; ++i) {
      if (boxes_[i].left < 0) follow(boxes_[i]);
    }
  });
  for (std::size_t i = boxes_.size(); i-- > 0;) {
    Box& node = boxes_[i];
    if (node.left < 0) continue;
    const Box& left = boxes_[node.left];
    const Box& right = boxes_[static_cast<std::size_t>(node.left) + 1];
    node.box = left.box.merged(right.box);
    node.areas = left.areas.merged(right.areas);
  }
}

void BodySurface::follow(Box& leaf) {
  leaf.box.setEmpty();
  leaf.areas.setEmpty();
  for (int k = leaf.first; k < leaf.first + leaf.count; ++k) {
    const auto& [a, b, c] = face(order_[k]);
    const auto& x = positions_;
    const Eigen::Vector3d area = (x.col(b) - x.col(a)).cross(x.col(c) - x.col(a));
    face_areas_.col(order_[k]) = area;
    leaf.areas.extend(area);
    for (const int n : {a, b, c}) leaf.box.extend(x.col(n));
  }
}

Eigen::Vector3d BodySurface::node_normal(int node) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = around_start_[node]; i < around_start_[node + 1]; ++i) sum += face_areas_.col(around_[i]);
  return sum.normalized();
}

Eigen::Vector3d BodySurface::normal(const SurfacePoint& point) const {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto corner = static_cast<std::size_t>(3 * point.face + k);
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    for (int i = smooth_start_[corner]; i < smooth_start_[corner + 1]; ++i) {
      area += face_areas_.col(smooth_faces_[i]);
    }
    normal += point.weights[k] * area.normalized();
  }
  return normal.normalized();
}

SurfacePoint BodySurface::point_on(int face, const Eigen::Vector3d& x, double& squared) const {
  const auto& [a, b, c] = faces_[face];
  SurfacePoint point{.face = face};
  point.weights = closest_weights(x, positions_.col(a), positions_.col(b), positions_.col(c));
  point.position = point.weights[0] * positions_.col(a) + point.weights[1] * positions_.col(b) +
                   point.weights[2] * positions_.col(c);
  squared = (x - point.position).squaredNorm();
  return point;
}

SurfacePoint BodySurface::closest(const Eigen::Vector3d& x, const Eigen::Vector3d& facing, double range,
                                  int near) const {
  constexpr double kRounding = 1e-12;  // relative, and in m: a point of a face lies in its box but for that
  SurfacePoint best;
  double best_squared = range * range;
  if (near >= 0 && face_areas_.col(near).dot(facing) < 0) {
    double squared = 0;
    (void)point_on(near, x, squared);
    best_squared = std::min(best_squared, squared);
  }
  std::array<int, kStack> stack{};
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Box& node = boxes_[stack[--depth]];
    if (node.box.squaredExteriorDistance(x) > (1 + kRounding) * best_squared + kRounding * kRounding) continue;
    if (against(node.areas, facing) > kRounding * kRounding) continue;  // none looks against it
    if (node.left >= 0) {
      stack[depth++] = node.left;
      stack[depth++] = node.left + 1;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const int f = order_[k];
      if (face_areas_.col(f).dot(facing) >= 0) continue;
      double squared = 0;
      const SurfacePoint point = point_on(f, x, squared);
      if (squared > best_squared) continue;
      best_squared = squared;
      best = point;
    }
  }
  if (best.face < 0) return best;
  best.distance = std::sqrt(best_squared);
  best.on_crease = best.weights.minCoeff() == 0;
  for (int k = 0; k < 3; ++k) {
    if (best.weights[k] > 0 && creased_[3 * best.face + k] == 0) best.on_crease = false;
  }
  return best;
}

void BodySurface::faces_in(const Eigen::AlignedBox3d& box, std::vector<int>& out) const {
  std::array<int, kStack> stack{};
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Box& node = boxes_[stack[--depth]];
    if (!node.box.intersects(box)) continue;
    if (node.left >= 0) {
      stack[depth++] = node.left;
      stack[depth++] = node.left + 1;
      continue;
    }
    out.insert(out.end(), order_.begin() + node.first, order_.begin() + node.first + node.count);
  }
}

}  // namespace stylet::physics
