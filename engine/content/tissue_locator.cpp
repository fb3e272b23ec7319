#include "engine/content/tissue_locator.h"

#include "engine/content/breathing.h"
#include "engine/content/voxel.h"

#include <algorithm>
#include <cstddef>

namespace stylet::content {

TissueLocator::TissueLocator(const Scene& scene) : scene_(scene) {
  for (const DeformableBody& body : scene.bodies) {
    topologies_.emplace_back(body.mesh);
    Eigen::Matrix3Xd& rest = rest_.emplace_back(3, static_cast<Eigen::Index>(body.mesh.nodes.size()));
    for (Eigen::Index n = 0; n < rest.cols(); ++n) rest.col(n) = body.mesh.nodes[n];
  }
}

void TissueLocator::update(const physics::TissueState& tissue, double time_s) {
  tissue_ = &tissue;
  breath_ = inspiration(scene_.breathing, time_s) * scene_.breathing.rigid_motion;
  for (std::size_t b = 0; b < topologies_.size(); ++b) {
    const Eigen::Matrix3Xd& x = tissue.positions[b];
    boxes_[b] = {x.rowwise().minCoeff(), x.rowwise().maxCoeff()};
  }
}

TissueLocator::Carrier TissueLocator::find_body(const Eigen::Vector3d& x) {
  for (std::size_t b = topologies_.size(); b-- > 0;) {
    if (!boxes_[b].contains(x)) continue;
    const physics::TetPoint at = topologies_[b].locate(tissue_->positions[b], x, hints_[b]);
    if (at.tet < 0) continue;
    hints_[b] = at.tet;
    return {static_cast<int>(b), at};
  }
  return {};
}

TissuePlace TissueLocator::find(const Eigen::Vector3d& x) {
  TissuePlace place = labelled(find_body(x), x);
  for (std::size_t i = 0; i < scene_.forbidden.size(); ++i) {
    const Forbidden& organ = scene_.forbidden[i];
    if (organ.body != place.body) continue;  // it was there at rest, but what is there now moves otherwise
    const std::ptrdiff_t voxel = voxel_at(scene_.labels, place.rest);
    const std::ptrdiff_t inside = voxel_at(organ.inside, place.rest);
    if (voxel < 0 || inside < 0 || organ.inside.labels[inside] == 0) continue;
    if (scene_.labels.labels[voxel] == organ.tissue && scene_.labels.bodies[voxel] == organ.body)
      place.forbidden |= 1U << i;
  }
  return place;
}

// A voxel tells what is there only where the point moves as the voxel's organ does.
TissuePlace TissueLocator::labelled(const Carrier& at, const Eigen::Vector3d& x) const {
  const LabelVolume& labels = scene_.labels;
  const auto tissue_of = [&](std::ptrdiff_t voxel, int body) {
    if (voxel < 0 || labels.bodies[voxel] != body) return -1;
    return static_cast<int>(labels.labels[voxel]);
  };
  const int still = tissue_of(voxel_at(labels, x), -1);
  if (at.body >= 0) {
    const auto b = static_cast<std::size_t>(at.body);
    const Eigen::Vector3d rest = topologies_[b].position(rest_[b], at.point);
    if (still >= 0 && is_bone(scene_.tissues[still])) {
      return {.tissue = still, .rest = x};
    }
    const int tissue = tissue_of(voxel_at(labels, rest), at.body);
    // Where the mesh is not quite the organ, its tetrahedron tells.
    return {
        .tissue = tissue >= 0 ? tissue : scene_.bodies[b].tet_tissue[at.point.tet], .body = at.body, .rest = rest};
  }
  if (const int tissue = tissue_of(voxel_at(labels, x - breath_), kBreathes); tissue >= 0) {
    return {.tissue = tissue, .body = kBreathes, .rest = x - breath_};
  }
  return {.tissue = std::max(still, 0), .rest = x};
}

TissueLocator::Carrier TissueLocator::carrier(const Eigen::Vector3d& rest) const {
  for (std::size_t b = topologies_.size(); b-- > 0;) {
    const physics::TetPoint at = topologies_[b].locate(rest_[b], rest, -1);
    if (at.tet >= 0) return {static_cast<int>(b), at};
  }
  return {};
}

Eigen::Vector3d TissueLocator::carried(const Carrier& at, const Eigen::Vector3d& rest) const {
  if (at.body < 0) return rest;
  const auto b = static_cast<std::size_t>(at.body);
  return topologies_[b].position(tissue_->positions[b], at.point);
}

}  // namespace stylet::content
