// A small patient without files: a cube of tissue, an 18G needle above it, a motion that goes in, out and in again.
#pragma once

#include "engine/content/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace stylet::tests {

/// A box of Kuhn tetrahedra of tissue 1 with `cells` along x, y and z; nothing is held.
/// @param low, high  corners, m
inline content::DeformableBody box_body(const std::string& name, const Eigen::Vector3d& low,
                                        const Eigen::Vector3d& high, const std::array<int, 3>& cells) {
  content::DeformableBody body;
  body.name = name;
  const auto [nx, ny, nz] = cells;
  const auto id = [nx = nx, ny = ny](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        const Eigen::Array3d share(static_cast<double>(i) / nx, static_cast<double>(j) / ny,
                                   static_cast<double>(k) / nz);
        body.mesh.nodes.emplace_back(low.array() + share * (high - low).array());
      }
    }
  }
  // Kuhn: one tetrahedron for each order of stepping along x, y, z from corner to corner.
  constexpr std::array<std::array<int, 3>, 6> kOrders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        for (std::size_t o = 0; o < kOrders.size(); ++o) {
          std::array<int, 3> corner{i, j, k};
          std::array<int, 4> tet{id(i, j, k), 0, 0, 0};
          for (std::size_t s = 0; s < 3; ++s) {
            ++corner[kOrders[o][s]];
            tet[s + 1] = id(corner[0], corner[1], corner[2]);
          }
          if (o >= 3) std::swap(tet[1], tet[2]);  // odd orders are mirrored
          body.mesh.tets.push_back(tet);
          body.tet_tissue.push_back(1);
        }
      }
    }
  }
  return body;
}

/// Holds the nodes that `held` says.
template <typename Held>
void hold(content::DeformableBody& body, const Held& held) {
  for (std::size_t n = 0; n < body.mesh.nodes.size(); ++n) {
    if (held(body.mesh.nodes[n])) body.fixed_nodes.push_back(static_cast<int>(n));
  }
}

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
  gel.needle = {.puncture_force = 1.0, .cutting_force = 0.5, .cutting_viscosity = 2, .friction_per_length = 18};
  scene.tissues = {outside, gel};
  content::DeformableBody body = box_body("cube", {-0.05, -0.05, 0}, {0.05, 0.05, 0.1}, {n - 1, n - 1, n - 1});
  hold(body, [](const Eigen::Vector3d& x) { return x.z() == 0; });
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
