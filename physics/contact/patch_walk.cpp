#include "physics/contact/patch_walk.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::physics {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

namespace {

constexpr int kMostFaces = 32;     // of one slide
constexpr double kSteepest = 0.3;  // cosine between a face and the plane that is slid in
constexpr double kFlat = 1e-3;     // the same of the face as it is deformed: the slide is no place on it

/// Corner of the tetrahedron opposite its face on the surface, the nearest if there are several; -1: none.
int apex_of_surface(const BodyPatch& nodes, const PatchWalk& at) {
  const auto& neighbours = nodes.tet_neighbours[at.patch_tet];
  int apex = -1;
  for (int k = 0; k < 4; ++k) {
    if (neighbours[k] != kBeyondSurface) continue;
    if (apex < 0 || at.barycentric[k] < at.barycentric[apex]) apex = k;
  }
  return apex;
}

int corner_of(const BodyPatch& nodes, int tet, int node) {
  const auto& corners = nodes.tet_nodes[tet];
  return static_cast<int>(std::find(corners.begin(), corners.end(), node) - corners.begin());
}

/// Outward unit normal without needle force.
Vector3d normal_of_face(const BodyPatch& nodes, int tet, int apex) {
  const auto& corners = nodes.tet_nodes[tet];
  std::array<Vector3d, 3> x;
  for (std::size_t k = 0, n = 0; k < 4; ++k) {
    if (static_cast<int>(k) != apex) x[n++] = nodes.free_positions.col(corners[k]);
  }
  const Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
  const Vector3d inside = nodes.free_positions.col(corners[apex]);
  return normal.dot(inside - x[0]) > 0 ? Vector3d(-normal) : normal;
}

/// Goes on to the next face on the surface: round the edge of the present one that is opposite corner `over`.
/// @return false where the patch ends
bool turn_edge(const BodyPatch& nodes, int over, int& apex, PatchWalk& walk) {
  const auto* corners = &nodes.tet_nodes[walk.patch_tet];
  std::array<int, 2> edge{};  // nodes
  std::array<double, 2> weights{};
  for (int k = 0, n = 0; k < 4; ++k) {
    if (k == over || k == apex) continue;
    edge[n] = (*corners)[k];
    weights[n++] = walk.barycentric[k];
  }
  const double depth = walk.barycentric[apex];
  int tet = walk.patch_tet;
  int near = over;  // corners off the edge: on the face last passed, and beyond it
  int far = apex;
  for (int tets = 0; tets < nodes.tet_count; ++tets) {
    const int next = nodes.tet_neighbours[tet][near];
    if (next == kBeyondPatch) return false;
    if (next == kBeyondSurface) {
      walk.patch_tet = tet;
      walk.barycentric.setZero();
      walk.barycentric[near] = depth;
      for (std::size_t n = 0; n < 2; ++n) walk.barycentric[corner_of(nodes, tet, edge[n])] = weights[n];
      apex = near;
      return true;
    }
    near = corner_of(nodes, next, (*corners)[far]);
    tet = next;
    corners = &nodes.tet_nodes[tet];
    for (far = 0; far == near || (*corners)[far] == edge[0] || (*corners)[far] == edge[1];) {
      ++far;
    }
  }
  return false;
}

/// @param position_of  a node, by its index in the patch
template <class PositionOf>
PatchWalk walk(const BodyPatch& nodes, int patch_tet, const Vector3d& x, const PositionOf& position_of) {
  constexpr int kMostSteps = 64;
  constexpr double kOnFace = -1e-9;
  PatchWalk walk;
  walk.patch_tet = patch_tet;
  walk.left = PatchWalk::Left::patch;  // where it comes to no end
  for (int step = 0; step < kMostSteps; ++step) {
    const auto t = static_cast<std::size_t>(walk.patch_tet);
    std::array<Vector3d, 4> corner;
    for (std::size_t k = 0; k < 4; ++k) corner[k] = position_of(nodes.tet_nodes[t][k]);
    Matrix3d edges;
    edges << corner[1] - corner[0], corner[2] - corner[0], corner[3] - corner[0];
    const Vector3d weights = edges.inverse() * (x - corner[0]);
    if (!std::isfinite(weights.sum())) break;
    walk.barycentric << 1 - weights.sum(), weights;
    int face = 0;
    const double least = walk.barycentric.minCoeff(&face);
    if (!(least < kOnFace)) {
      walk.left = PatchWalk::Left::nothing;
      return walk;
    }
    const int next = nodes.tet_neighbours[t][face];
    if (next < 0) {
      if (next == kBeyondSurface) walk.left = PatchWalk::Left::body;
      break;
    }
    if (step + 1 < kMostSteps) walk.patch_tet = next;
  }
  walk.barycentric = walk.barycentric.cwiseMax(0.0);
  walk.barycentric /= walk.barycentric.sum();
  return walk;
}

}  // namespace

PatchWalk slide_on_surface(const TissuePatch& patch, int body, const PatchWalk& from,
                           const Eigen::Matrix<double, 3, 2>& across, const Eigen::Vector2d& slide,
                           const TissuePoints& tissue) {
  const BodyPatch& nodes = patch.bodies[body];
  const Vector3d along = across.col(0).cross(across.col(1));
  PatchWalk walk = from;
  walk.left = PatchWalk::Left::nothing;
  const auto position_of = [&](int tet, int corner) {
    const auto& corners = nodes.tet_nodes[tet];
    return tissue.node_position(patch, body, corners[corner]);
  };
  int apex = apex_of_surface(nodes, walk);
  if (apex < 0) {
    Vector3d x = across * slide;
    for (int k = 0; k < 4; ++k) x += from.barycentric[k] * position_of(from.patch_tet, k);
    return walk_patch(patch, body, from.patch_tet, x, tissue);
  }
  Eigen::Vector2d rest = slide;
  for (int faces = 0; faces < kMostFaces; ++faces) {
    std::array<int, 3> rim{};  // corners of the face
    for (int k = 0, n = 0; k < 4; ++k) {
      if (k != apex) rim[n++] = k;
    }
    Matrix3d x;
    for (int n = 0; n < 3; ++n) x.col(n) = position_of(walk.patch_tet, rim[n]);
    Eigen::Matrix<double, 3, 2> edges;
    edges << x.col(1) - x.col(0), x.col(2) - x.col(0);
    const Eigen::Matrix2d plane = across.transpose() * edges;
    const double area = edges.col(0).cross(edges.col(1)).norm();
    if (!(std::abs(plane.determinant()) > kFlat * area)) break;
    const Eigen::Vector2d moved = plane.inverse() * rest;
    const Vector3d change(-moved.sum(), moved[0], moved[1]);
    double part = 1;  // up to the first edge
    int over = -1;
    for (int n = 0; n < 3; ++n) {
      const double weight = walk.barycentric[rim[n]];
      if (weight + part * change[n] >= 0) continue;
      part = weight / -change[n];
      over = rim[n];
    }
    for (int n = 0; n < 3; ++n) {
      double& weight = walk.barycentric[rim[n]];
      weight = std::max(0.0, weight + part * change[n]);
    }
    if (over < 0) return walk;
    walk.barycentric[over] = 0;
    walk.barycentric /= walk.barycentric.sum();
    rest *= 1 - part;
    PatchWalk next = walk;
    if (!turn_edge(nodes, over, apex, next)) break;
    if (std::abs(normal_of_face(nodes, next.patch_tet, apex).dot(along)) < kSteepest) {
      walk.left = PatchWalk::Left::body;
      return walk;
    }
    walk = next;
  }
  walk.left = PatchWalk::Left::patch;
  return walk;
}

Vector3d surface_normal(const TissuePatch& patch, int body, const PatchWalk& at) {
  const BodyPatch& nodes = patch.bodies[body];
  const int apex = apex_of_surface(nodes, at);
  return apex < 0 ? Vector3d(Vector3d::Zero()) : normal_of_face(nodes, at.patch_tet, apex);
}

PatchWalk walk_patch(const TissuePatch& patch, int body, int patch_tet, const Vector3d& x,
                     const TissuePoints& tissue) {
  return walk(patch.bodies[body], patch_tet, x, [&](int node) { return tissue.node_position(patch, body, node); });
}

PatchWalk walk_patch_at_rest(const TissuePatch& patch, int body, int patch_tet, const Vector3d& x) {
  const BodyPatch& nodes = patch.bodies[body];
  return walk(nodes, patch_tet, x, [&](int node) -> Vector3d { return nodes.rest_positions.col(node); });
}

bool inside_out(const TissuePatch& patch, int body, int patch_tet, const TissuePoints& tissue) {
  const BodyPatch& nodes = patch.bodies[body];
  const auto& corners = nodes.tet_nodes[patch_tet];
  Matrix3d now, rest;
  for (int k = 0; k < 3; ++k) {
    now.col(k) = tissue.node_position(patch, body, corners[k + 1]) - tissue.node_position(patch, body, corners[0]);
    rest.col(k) = nodes.rest_positions.col(corners[k + 1]) - nodes.rest_positions.col(corners[0]);
  }
  return now.determinant() * rest.determinant() <= 0;
}

Vector3d rest_position(const TissuePatch& patch, int body, const PatchContact& point) {
  const BodyPatch& nodes = patch.bodies[body];
  Vector3d rest = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    rest += point.barycentric[static_cast<Eigen::Index>(k)] * nodes.rest_positions.col(point.patch_nodes[k]);
  }
  return rest;
}

}  // namespace stylet::physics
