#include "physics/tissue/tet_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace stylet::physics {
namespace {

constexpr double kInside = -1e-10;  // barycentric weight that still counts as inside: rounding on shared faces
constexpr int kMaxWalk = 200;
constexpr double kSameCrossing = 1e-9;  // m; hits on an edge shared by two faces

double triple(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return a.dot(b.cross(c));
}

/// Which of the six planes of a box a point is outside of, a bit each (Cohen and Sutherland): what has a bit in
/// common is all on the far side of that plane.
std::uint8_t outcode(const Eigen::Vector3d& x, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  unsigned code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    code |= static_cast<unsigned>(x[axis] < low[axis]) << (2 * axis);
    code |= static_cast<unsigned>(x[axis] > high[axis]) << (2 * axis + 1);
  }
  return static_cast<std::uint8_t>(code);
}

}  // namespace

TetTopology::TetTopology(const TetMesh& mesh)
    : tets_(mesh.tets), neighbours_(mesh.tets.size(), std::array<int, 4>{-1, -1, -1, -1}) {
  struct Face {
    std::array<int, 3> key;
    int tet;
    int face;
  };
  std::vector<Face> faces;
  faces.reserve(4 * tets_.size());
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    for (std::size_t f = 0; f < 4; ++f) {
      std::array<int, 3> key{};
      for (std::size_t k = 0; k < 3; ++k) key[k] = tets_[t][kFaceCorners[f][k]];
      std::sort(key.begin(), key.end());
      faces.push_back({key, static_cast<int>(t), static_cast<int>(f)});
    }
  }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.key != b.key ? a.key < b.key : a.tet < b.tet; });
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& face = faces[i];
    if (i + 1 < faces.size() && faces[i + 1].key == face.key) {
      const Face& other = faces[++i];
      neighbours_[face.tet][face.face] = other.tet;
      neighbours_[other.tet][other.face] = face.tet;
      continue;
    }
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const int corner = kFaceCorners[face.face][k];
      corners[k] = tets_[face.tet][corner];
    }
    surface_faces_.push_back(corners);
    surface_tets_.push_back({face.tet, face.face});
    surface_nodes_.insert(surface_nodes_.end(), corners.begin(), corners.end());
  }
  std::sort(surface_nodes_.begin(), surface_nodes_.end());
  surface_nodes_.erase(std::unique(surface_nodes_.begin(), surface_nodes_.end()), surface_nodes_.end());
}

Eigen::Vector4d TetTopology::barycentric(const Eigen::Matrix3Xd& positions, int tet, const Eigen::Vector3d& x) const {
  const auto& n = nodes(tet);
  const Eigen::Vector3d a = positions.col(n[1]) - positions.col(n[0]);
  const Eigen::Vector3d b = positions.col(n[2]) - positions.col(n[0]);
  const Eigen::Vector3d c = positions.col(n[3]) - positions.col(n[0]);
  const Eigen::Vector3d d = x - positions.col(n[0]);
  const double volume = triple(a, b, c);
  if (volume == 0) return Eigen::Vector4d::Zero();
  Eigen::Vector4d weights;
  weights[1] = triple(d, b, c) / volume;
  weights[2] = triple(a, d, c) / volume;
  weights[3] = triple(a, b, d) / volume;
  weights[0] = 1 - weights[1] - weights[2] - weights[3];
  return weights;
}

Eigen::Vector3d TetTopology::position(const Eigen::Matrix3Xd& positions, const TetPoint& point) const {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  const auto& n = nodes(point.tet);
  for (int a = 0; a < 4; ++a) x += point.barycentric[a] * positions.col(n[a]);
  return x;
}

TetPoint TetTopology::walk(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& x, int hint) const {
  int tet = hint;  // through the face of the most negative weight
  for (int i = 0; i < kMaxWalk && tet >= 0; ++i) {
    const Eigen::Vector4d weights = barycentric(positions, tet, x);
    int face = 0;
    if (weights.minCoeff(&face) >= kInside && weights.sum() > 0.5) return {tet, weights};
    tet = neighbour(tet, face);
  }
  return {};
}

TetPoint TetTopology::locate(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& x, int hint) const {
  if (const TetPoint point = walk(positions, x, hint); point.tet >= 0) return point;
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    const auto& n = tets_[t];
    bool outside = false;
    for (int axis = 0; axis < 3 && !outside; ++axis) {
      const double p0 = positions(axis, n[0]);
      const double p1 = positions(axis, n[1]);
      const double p2 = positions(axis, n[2]);
      const double p3 = positions(axis, n[3]);
      const double low = std::min(std::min(p0, p1), std::min(p2, p3));
      const double high = std::max(std::max(p0, p1), std::max(p2, p3));
      const double slack = 1e-9 * (high - low);
      outside = x[axis] < low - slack || x[axis] > high + slack;
    }
    if (outside) continue;
    const Eigen::Vector4d weights = barycentric(positions, static_cast<int>(t), x);
    if (weights.minCoeff() >= kInside && weights.sum() > 0.5) return {static_cast<int>(t), weights};
  }
  return {};
}

TetPoint TetTopology::follow(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& from, bool inside,
                             const Eigen::Vector3d& x, int hint) const {
  if (const TetPoint point = walk(positions, x, hint); point.tet >= 0) return point;
  std::vector<SurfaceCrossing> crossed;
  crossings(positions, from, (x - from).normalized(), (x - from).norm(), crossed);
  if (crossed.empty() ? !inside : !crossed.back().entering) return {};
  return locate(positions, x, crossed.empty() ? hint : crossed.back().point.tet);
}

void TetTopology::crossings(const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction, double length,
                            std::vector<SurfaceCrossing>& out) const {
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  const Eigen::Vector3d end = origin + length * direction;
  const Eigen::Vector3d low = origin.cwiseMin(end);
  const Eigen::Vector3d high = origin.cwiseMax(end);
  std::vector<std::uint8_t> outside(static_cast<std::size_t>(positions.cols()));
  for (const int n : surface_nodes_) outside[n] = outcode(positions.col(n), low, high);
  const auto outside_of = [&](int node) { return outside[node]; };
  for (std::size_t f = 0; f < surface_faces_.size(); ++f) {
    const std::array<int, 3>& nodes = surface_faces_[f];
    if ((outside_of(nodes[0]) & outside_of(nodes[1]) & outside_of(nodes[2])) != 0) continue;
    const Eigen::Vector3d a = positions.col(nodes[0]);
    const Eigen::Vector3d b = positions.col(nodes[1]);
    const Eigen::Vector3d c = positions.col(nodes[2]);
    const Eigen::Vector3d ab = b - a;
    const Eigen::Vector3d ac = c - a;
    const Eigen::Vector3d area = ab.cross(ac);
    const double facing = -direction.dot(area);  // > 0: the line goes in
    if (std::abs(facing) <= 1e-12 * area.norm()) continue;
    const Eigen::Vector3d ao = origin - a;
    const double s = ao.dot(area) / facing;
    if (!(s >= 0 && s <= length)) continue;
    const Eigen::Vector3d hit = ao + s * direction;
    const double square = area.squaredNorm();
    const double weight_b = area.dot(hit.cross(ac)) / square;
    const double weight_c = area.dot(ab.cross(hit)) / square;
    const double weight_a = 1 - weight_b - weight_c;
    if (std::min({weight_a, weight_b, weight_c}) < kInside) continue;
    SurfaceCrossing crossing;
    crossing.distance = s;
    const FaceOfTet& hit_face = surface_tets_[f];
    const std::array<int, 3>& corners = kFaceCorners[hit_face.face];
    crossing.point.tet = hit_face.tet;
    crossing.point.barycentric[corners[0]] = weight_a;
    crossing.point.barycentric[corners[1]] = weight_b;
    crossing.point.barycentric[corners[2]] = weight_c;
    crossing.normal = area.normalized();
    crossing.entering = facing > 0;
    out.push_back(crossing);
  }
  std::sort(out.begin() + first, out.end(), [](const SurfaceCrossing& a, const SurfaceCrossing& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.point.tet < b.point.tet;
  });
  const auto last =
      std::unique(out.begin() + first, out.end(), [](const SurfaceCrossing& a, const SurfaceCrossing& b) {
        return a.entering == b.entering && b.distance - a.distance < kSameCrossing;
      });
  out.erase(last, out.end());
}

}  // namespace stylet::physics
