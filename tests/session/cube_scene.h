// A small patient without files: a cube of tissue, an 18G needle above it, a motion that goes in, out and in again.
#pragma once

#include "engine/content/scene.h"

#include <array>
#include <cmath>
#include <numbers>

namespace stylet::tests {

/// 100 mm cube, x and y in [-50, 50] mm, z in [0, 100] mm, face z = 0 fixed, `n` nodes an edge, Kuhn tetrahedra; the
/// needle comes from +z.
inline content::Scene cube_scene(int n = 6) {
  content::Scene scene;
  scene.name = "cube";
  scene.scenario = "cube";
  content::Tissue outside;
  outside.name = "outside";
  content::Tissue gel;
  gel.name = "gel";
  gel.mechanics = {.young_modulus = 10e3, .poisson_ratio = 0.45};
  scene.tissues = {outside, gel};
  content::DeformableBody body;
  body.name = "cube";
  const double h = 0.1 / (n - 1);
  const auto id = [n](int i, int j, int k) { return i + n * (j + n * k); };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        body.mesh.nodes.emplace_back(i * h - 0.05, j * h - 0.05, k * h);
        if (k == 0) body.fixed_nodes.push_back(id(i, j, k));
      }
    }
  }
  // Kuhn: one tetrahedron for each order of stepping along x, y, z from corner to corner.
  constexpr std::array<std::array<int, 3>, 6> kOrders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k + 1 < n; ++k) {
    for (int j = 0; j + 1 < n; ++j) {
      for (int i = 0; i + 1 < n; ++i) {
        for (std::size_t o = 0; o < kOrders.size(); ++o) {
          std::array<int, 3> corner{i, j, k};
          std::array<int, 4> tet{id(i, j, k), 0, 0, 0};
          for (std::size_t s = 0; s < 3; ++s) {
            ++corner[static_cast<std::size_t>(kOrders[o][s])];
            tet[s + 1] = id(corner[0], corner[1], corner[2]);
          }
          if (o >= 3) std::swap(tet[1], tet[2]);  // odd orders are mirrored
          body.mesh.tets.push_back(tet);
          body.tet_tissue.push_back(1);
        }
      }
    }
  }
  scene.bodies.push_back(body);
  scene.targets.push_back({.name = "target", .centre = {0, 0, 0.045}, .radius = 0.01});
  // Straight down, 40 mm/s, with a sideways swing; half out; in again.
  const Eigen::Quaterniond down(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  for (int i = 0; i <= 150; ++i) {
    const double t = i * 0.01;
    const double depth = -0.005 + 0.03 * (1 - std::cos(2 * std::numbers::pi * t / 1.0)) * (t < 1.0 ? 1.0 : 0.8);
    const double swing = 0.004 * std::sin(2 * std::numbers::pi * t);
    scene.motion.stylus.push_back(
        {.time_s = t, .pose = {.position = {swing, 0, 0.1 + scene.needle.length - depth}, .orientation = down}});
  }
  return scene;
}

}  // namespace stylet::tests
