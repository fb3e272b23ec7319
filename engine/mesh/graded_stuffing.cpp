#include "engine/mesh/graded_stuffing.h"

#include "engine/mesh/tet_smoothing.h"

#include <algorithm>

namespace stylet::mesh {
namespace {

constexpr double kLeastReach = 4;  // cells

}  // namespace

physics::TetMesh stuff_graded(const SignedDistance& distance, const Eigen::AlignedBox3d& box, double cell,
                              int smoothing, const Grading& grading) {
  const double reach = std::max(-distance(grading.target), kLeastReach * cell);
  const double least = 1 / grading.factor;
  // x = target + g u, with g from 1/factor in the middle to 1 at the rim; g and its slope are continuous there.
  const auto draw_together = [&](const Eigen::Vector3d& lattice) -> Eigen::Vector3d {
    const Eigen::Vector3d u = lattice - grading.target;
    const double t = std::min(u.norm() / reach, 1.0);
    return grading.target + (least + (1 - least) * t * t * (3 - 2 * t)) * u;
  };
  physics::TetMesh mesh =
      stuff([&](const Eigen::Vector3d& x) { return distance(draw_together(x)); }, box, cell, smoothing);
  for (Eigen::Vector3d& node : mesh.nodes) {
    if ((node - grading.target).norm() < reach) node = draw_together(node);
  }
  smooth(mesh, distance, cell, smoothing);
  return mesh;
}

}  // namespace stylet::mesh
