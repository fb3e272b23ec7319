#include "engine/import/enclosed_solid.h"

#include "engine/mesh/nearest_on_triangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stylet::import {
namespace {

constexpr float kFar = std::numeric_limits<float>::max();
constexpr double kBand = 1.8;  // spacings from a triangle within which nodes are told of it: past a diagonal
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Nodes of a regular grid, x fastest.
struct Grid {
  Eigen::Vector3f origin;
  float spacing = 0;
  Eigen::Vector3i size;

  std::size_t node(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size.x()) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(k));
  }
  std::size_t count() const { return node(0, 0, size.z()); }
  Eigen::Vector3f position(int i, int j, int k) const {
    return origin + spacing * Eigen::Vector3i(i, j, k).cast<float>();
  }
};

/// The nearest of some points for every node of a grid: told near the points, then passed on from neighbour to
/// neighbour (Danielsson 1980; off by a small fraction of the spacing where three points are about equally far).
class NearestPoints {
public:
  NearestPoints(const Grid& grid, const files::Pulse& pulse)
      : grid_(grid), pulse_(pulse), point_of_(grid.count(), kNone), squared_(grid.count(), kFar) {}

  void offer(std::size_t node, const Eigen::Vector3f& x, const Eigen::Vector3f& point) {
    const float squared = (x - point).squaredNorm();
    if (squared >= squared_[node]) return;
    if (point_of_[node] == kNone) {
      point_of_[node] = static_cast<std::uint32_t>(points_.size());
      points_.push_back(point);
    } else {
      points_[point_of_[node]] = point;  // of this node alone until spread()
    }
    squared_[node] = squared;
  }

  void spread() {
    const Eigen::Vector3i& n = grid_.size;
    for (const int up : {1, -1}) {
      for (int step = 0; step < n.z(); ++step) {
        pulse_.now();
        const int k = up > 0 ? step : n.z() - 1 - step;
        if (k - up >= 0 && k - up < n.z()) {
          for (int j = 0; j < n.y(); ++j) {
            for (int i = 0; i < n.x(); ++i) take_from_plane(i, j, k, k - up);
          }
        }
        for (const int forth : {1, -1}) {
          for (int row = 0; row < n.y(); ++row) spread_row(forth > 0 ? row : n.y() - 1 - row, k, forth);
        }
      }
    }
  }

  const Eigen::Vector3f& point(std::size_t node) const { return points_[point_of_[node]]; }
  float distance(std::size_t node) const { return std::sqrt(squared_[node]); }

private:
  void take(std::size_t node, const Eigen::Vector3f& x, std::size_t from) {
    const std::uint32_t point = point_of_[from];
    if (point == kNone || point == point_of_[node]) return;
    const float squared = (x - points_[point]).squaredNorm();
    if (squared >= squared_[node]) return;
    squared_[node] = squared;
    point_of_[node] = point;
  }
  void take_from_plane(int i, int j, int k, int other) {
    const std::size_t node = grid_.node(i, j, k);
    const Eigen::Vector3f x = grid_.position(i, j, k);
    for (int b = std::max(0, j - 1); b <= std::min(grid_.size.y() - 1, j + 1); ++b) {
      for (int a = std::max(0, i - 1); a <= std::min(grid_.size.x() - 1, i + 1); ++a) {
        take(node, x, grid_.node(a, b, other));
      }
    }
  }
  void spread_row(int j, int k, int forth) {
    const int width = grid_.size.x();
    const int other = j - forth;
    if (other >= 0 && other < grid_.size.y()) {
      for (int i = 0; i < width; ++i) {
        const Eigen::Vector3f x = grid_.position(i, j, k);
        for (int a = std::max(0, i - 1); a <= std::min(width - 1, i + 1); ++a) {
          take(grid_.node(i, j, k), x, grid_.node(a, other, k));
        }
      }
    }
    for (int i = 1; i < width; ++i) take(grid_.node(i, j, k), grid_.position(i, j, k), grid_.node(i - 1, j, k));
    for (int i = width - 2; i >= 0; --i) take(grid_.node(i, j, k), grid_.position(i, j, k), grid_.node(i + 1, j, k));
  }

  const Grid& grid_;
  const files::Pulse& pulse_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint32_t> point_of_;  // [nodes] index into points_
  std::vector<float> squared_;           // [nodes] m^2
};

/// The nearest points of a surface, offered to the nodes around each triangle.
NearestPoints nearest_on_surface(const mesh::TriangleMesh& soup, const Grid& grid, const files::Pulse& pulse) {
  NearestPoints wall(grid, pulse);
  const double band = kBand * static_cast<double>(grid.spacing);
  std::size_t triangles = 0;
  for (const auto& [u, v, w] : soup.triangles) {
    if (++triangles % 256 == 0) pulse.now();
    const Eigen::Vector3d& a = soup.vertices[u];
    const Eigen::Vector3d& b = soup.vertices[v];
    const Eigen::Vector3d& c = soup.vertices[w];
    // Most nodes around a large triangle are far from its plane. The slack makes this hold for slivers, whose normal
    // is rounding.
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    const double far = band * (1 + 1e-9) + std::max(std::abs(normal.dot(b - a)), std::abs(normal.dot(c - a)));
    const Eigen::Array3d origin = grid.origin.cast<double>();
    const Eigen::Array3d least = (a.cwiseMin(b).cwiseMin(c).array() - band - origin) / grid.spacing;
    const Eigen::Array3d most = (a.cwiseMax(b).cwiseMax(c).array() + band - origin) / grid.spacing;
    const Eigen::Array3i low = least.ceil().cast<int>().max(0);
    const Eigen::Array3i high = most.floor().cast<int>().min(grid.size.array() - 1);
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) {
          const Eigen::Vector3f x = grid.position(i, j, k);
          const Eigen::Vector3d p = x.cast<double>();
          if (std::abs(normal.dot(p - a)) > far) continue;
          const Eigen::Vector3d nearest = mesh::nearest_on_triangle(p, a, b, c).point;
          if ((p - nearest).norm() <= band) wall.offer(grid.node(i, j, k), x, nearest.cast<float>());
        }
      }
    }
  }
  wall.spread();
  return wall;
}

/// Nodes that can be reached from the rim along the axes without coming closer to the wall than `radius`. An edge
/// through a wall has an end within half a spacing of it.
std::vector<char> flood(const NearestPoints& wall, const Grid& grid, float radius) {
  std::vector<char> outside(grid.count(), 0);
  std::vector<std::size_t> front{0};
  outside[0] = 1;
  const std::array<std::size_t, 3> step{1, grid.node(0, 1, 0), grid.node(0, 0, 1)};
  while (!front.empty()) {
    const std::size_t n = front.back();
    front.pop_back();
    const std::array<std::size_t, 3> index{n % step[1], n % step[2] / step[1], n / step[2]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<std::size_t>(grid.size[static_cast<Eigen::Index>(axis)]) - 1;
      for (const bool up : {false, true}) {
        if (index[axis] == (up ? last : 0)) continue;
        const std::size_t next = up ? n + step[axis] : n - step[axis];
        if (outside[next] != 0 || wall.distance(next) < radius) continue;
        outside[next] = 1;
        front.push_back(next);
      }
    }
  }
  return outside;
}

/// Nodes that nearest_on_surface() looks at, all triangles together, beyond those that points would take.
double nodes_to_look_at(const mesh::TriangleMesh& soup, double spacing) {
  double sum = 0;
  for (const auto& [u, v, w] : soup.triangles) {
    const Eigen::Vector3d &a = soup.vertices[u], &b = soup.vertices[v], &c = soup.vertices[w];
    const Eigen::Array3d extent = a.cwiseMax(b).cwiseMax(c) - a.cwiseMin(b).cwiseMin(c);
    sum += (extent / spacing + 2 * kBand).prod() - 8 * kBand * kBand * kBand;
  }
  return sum;
}

}  // namespace

EnclosedSolid::EnclosedSolid(const mesh::TriangleMesh& soup, double gap, double spacing, const Limits& limits,
                             const files::Pulse& pulse)
    : gap_(std::max(gap, 2 * spacing)), spacing_(spacing) {
  for (const Eigen::Vector3d& vertex : soup.vertices) bounds_.extend(vertex);
  // The rim lies outside the ball around every triangle.
  for (;; spacing_ *= 1.05, gap_ = std::max(gap_, 2 * spacing_)) {
    pulse.now();
    size_ = ((bounds_.sizes().array() + gap_) / spacing_).ceil().cast<int>() + 5;
    if (size_.cast<double>().prod() <= limits.nodes && nodes_to_look_at(soup, spacing_) <= limits.work) break;
  }
  origin_ = (bounds_.center() - spacing_ / 2 * (size_.cast<double>().array() - 1).matrix()).cast<float>();
  const Grid grid{.origin = origin_, .spacing = static_cast<float>(spacing_), .size = size_};
  const auto radius = static_cast<float>(gap_ / 2);
  const NearestPoints wall = nearest_on_surface(soup, grid, pulse);
  const std::vector<char> outside = flood(wall, grid, radius);

  // Where the ball that stops at the wall touches the flooded side.
  NearestPoints rim(grid, pulse);
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i) {
        const std::size_t n = grid.node(i, j, k);
        const float to_wall = wall.distance(n);
        if (outside[n] == 0 || to_wall > radius + static_cast<float>(kBand) * grid.spacing) continue;
        const Eigen::Vector3f x = grid.position(i, j, k);
        rim.offer(n, x, wall.point(n) + (radius / to_wall) * (x - wall.point(n)));
      }
    }
  }
  rim.spread();
  distance_.resize(grid.count());
  for (std::size_t n = 0; n < distance_.size(); ++n) {
    distance_[n] = outside[n] != 0 ? radius + rim.distance(n) : radius - rim.distance(n);
  }
}

double EnclosedSolid::signed_distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d grid = (point - origin_.cast<double>()) / spacing_;
  if ((grid.array() < 0).any() || (grid.array() > (size_.cast<double>().array() - 1)).any()) {
    return bounds_.exteriorDistance(point);
  }
  const Eigen::Vector3i cell = grid.array().floor().cast<int>().min(size_.array() - 2);
  const Eigen::Vector3d t = grid - cell.cast<double>();
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
    const double weight =
        (di != 0 ? t.x() : 1 - t.x()) * (dj != 0 ? t.y() : 1 - t.y()) * (dk != 0 ? t.z() : 1 - t.z());
    const Eigen::Vector3i node = cell + Eigen::Vector3i(di, dj, dk);
    sum += weight * distance_[static_cast<std::size_t>(node.x()) +
                              static_cast<std::size_t>(size_.x()) *
                                  (static_cast<std::size_t>(node.y()) +
                                   static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(node.z()))];
  }
  return sum;
}

double EnclosedSolid::volume() const {
  // A node stands for a cube; one at the surface for the part of it inside.
  double cubes = 0;
  for (const float d : distance_) cubes += std::clamp(0.5 - static_cast<double>(d) / spacing_, 0.0, 1.0);
  return cubes * spacing_ * spacing_ * spacing_;
}

double EnclosedSolid::area() const {
  const auto layer = static_cast<float>(spacing_);  // just outside
  const auto nodes = std::count_if(distance_.begin(), distance_.end(), [&](float d) { return d >= 0 && d < layer; });
  return static_cast<double>(nodes) * spacing_ * spacing_;
}

double EnclosedSolid::depth() const {
  return -static_cast<double>(*std::min_element(distance_.begin(), distance_.end()));
}

}  // namespace stylet::import
