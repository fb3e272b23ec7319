// The cube of the session's tests with skin that a probe can be moved on.
#pragma once

#include "tests/session/cube_scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>

namespace stylet::tests {

/// The cube with voxels, and a probe that presses on its upper face.
inline content::Scene pressed_cube() {
  content::Scene scene = cube_scene(5);
  content::LabelVolume& labels = scene.labels;
  labels.spacing = 0.0025F;
  labels.origin = {-0.06F, -0.06F, -0.01F};
  labels.size = {49, 49, 49};  // the cube's top face is at z = 0.1 m
  const std::size_t voxels = std::size_t(49) * 49 * 49;
  labels.labels.assign(voxels, 0);
  labels.bodies.assign(voxels, -1);
  std::size_t v = 0;
  for (int k = 0; k < 49; ++k) {
    for (int j = 0; j < 49; ++j) {
      for (int i = 0; i < 49; ++i, ++v) {
        const Eigen::Vector3f p = labels.origin + labels.spacing * Eigen::Vector3f(float(i), float(j), float(k));
        const bool inside = p.head<2>().cwiseAbs().maxCoeff() <= 0.05F && p.z() >= 0 && p.z() <= 0.1F;
        labels.labels[v] = inside ? 1 : 0;
        labels.bodies[v] = inside ? 0 : -1;
      }
    }
  }
  scene.probe.convex = false;
  scene.probe.width = 0.03;
  scene.probe.presses = 0;
  scene.probe.pose.position = {0.01, 0, 0.098};
  scene.probe.pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  return scene;
}

}  // namespace stylet::tests
