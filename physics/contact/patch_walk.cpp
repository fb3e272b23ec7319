#include "physics/contact/patch_walk.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <array>
#include <cmath>

namespace stylet::physics {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

PatchWalk walk_patch(const TissuePatch& patch, int body, int patch_tet, const Vector3d& x,
                     const TissuePoints& tissue) {
  constexpr int kMostSteps = 64;
  constexpr double kOnFace = -1e-9;
  const BodyPatch& nodes = patch.bodies[static_cast<std::size_t>(body)];
  PatchWalk walk;
  walk.patch_tet = patch_tet;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto t = static_cast<std::size_t>(walk.patch_tet);
    std::array<Vector3d, 4> corner;
    for (std::size_t k = 0; k < 4; ++k) corner[k] = tissue.node_position(patch, body, nodes.tet_nodes[t][k]);
    Matrix3d edges;
    edges << corner[1] - corner[0], corner[2] - corner[0], corner[3] - corner[0];
    const Vector3d weights = edges.inverse() * (x - corner[0]);
    if (!std::isfinite(weights.sum())) {
      walk.left = PatchWalk::Left::patch;
      break;
    }
    walk.barycentric << 1 - weights.sum(), weights;
    int face = 0;
    const double least = walk.barycentric.minCoeff(&face);
    if (!(least < kOnFace)) return walk;
    const int next = nodes.tet_neighbours[t][static_cast<std::size_t>(face)];
    if (next < 0) {
      walk.left = next == kBeyondSurface ? PatchWalk::Left::body : PatchWalk::Left::patch;
      break;
    }
    walk.patch_tet = next;
  }
  walk.barycentric = walk.barycentric.cwiseMax(0.0);
  walk.barycentric /= walk.barycentric.sum();
  return walk;
}

Vector3d rest_position(const TissuePatch& patch, int body, const PatchContact& point) {
  const BodyPatch& nodes = patch.bodies[static_cast<std::size_t>(body)];
  Vector3d rest = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    rest += point.barycentric[static_cast<Eigen::Index>(k)] * nodes.rest_positions.col(point.patch_nodes[k]);
  }
  return rest;
}

}  // namespace stylet::physics
