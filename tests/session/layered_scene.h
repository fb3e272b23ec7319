// A small patient of layers: wall of skin, fat and muscle, behind it a liver with a tumour; the needle comes from +z.
#pragma once

#include "engine/content/scene.h"
#include "tests/session/cube_scene.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace stylet::tests {

inline constexpr double kSkinSurface = 0.090;  ///< z of the layers' outer faces, m
inline constexpr double kFatSurface = 0.087;
inline constexpr double kMuscleSurface = 0.077;
inline constexpr double kWallBack = 0.060;
inline constexpr double kLiverSurface = 0.058;
inline constexpr double kTumourTop = 0.038;
inline constexpr double kTumourRadius = 0.010;

/// Tissues: 1 skin, 2 fat, 3 muscle, 4 liver, 5 tumour. The tip goes straight down from 5 mm above the skin to the
/// tumour's centre at 40 mm/s and rests there.
inline content::Scene layered_scene() {
  content::Scene scene;
  scene.name = "layers";
  scene.scenario = "layers";
  const auto tissue = [&](const char* name, double young, const physics::InsertionResistance& needle) {
    content::Tissue row;
    row.name = name;
    row.mechanics = {.young_modulus = young, .poisson_ratio = 0.45};
    row.needle = needle;
    scene.tissues.push_back(row);
  };
  tissue("outside", 10, {});
  tissue("skin", 100e3, {.puncture_force = 3.0, .cutting_force = 1.0, .friction_per_length = 20});
  tissue("fat", 10e3, {.puncture_force = 0.2, .cutting_force = 0.3, .friction_per_length = 10});
  tissue("muscle", 30e3, {.puncture_force = 0.8, .cutting_force = 0.6, .friction_per_length = 20});
  tissue("liver", 15e3, {.puncture_force = 1.8, .cutting_force = 0.9, .friction_per_length = 18});
  tissue("tumour", 40e3, {.puncture_force = 2.2, .cutting_force = 1.2, .friction_per_length = 25});
  scene.tissue_surfaces = {{.from = 2, .to = 3, .puncture_force = 1.2}, {.from = 5, .to = 4, .puncture_force = 1.5}};

  content::LabelVolume& labels = scene.labels;
  labels.origin = {-0.04F, -0.04F, 0};
  labels.size = {81, 81, 92};
  const auto tissue_at = [](const Eigen::Vector3d& x) -> std::uint8_t {
    if ((x - Eigen::Vector3d(0, 0, kTumourTop - kTumourRadius)).norm() < kTumourRadius) return 5;
    if (x.z() < kLiverSurface) return 4;
    if (x.z() < kWallBack) return 0;
    return x.z() < kMuscleSurface ? 3 : x.z() < kFatSurface ? 2 : x.z() < kSkinSurface ? 1 : 0;
  };
  for (int k = 0; k < labels.size.z(); ++k) {
    for (int j = 0; j < labels.size.y(); ++j) {
      for (int i = 0; i < labels.size.x(); ++i) {
        const std::uint8_t label = tissue_at(labels.origin.cast<double>() + 1e-3 * Eigen::Vector3d(i, j, k));
        labels.labels.push_back(label);
        labels.bodies.push_back(static_cast<std::int8_t>(label == 0 ? -1 : label >= 4 ? 1 : 0));
      }
    }
  }

  scene.bodies.push_back(box_body("wall", {-0.04, -0.04, kWallBack}, {0.04, 0.04, kSkinSurface}, {7, 7, 4}));
  hold(scene.bodies[0], [](const Eigen::Vector3d& x) { return std::max(std::abs(x.x()), std::abs(x.y())) > 0.039; });
  scene.bodies.push_back(box_body("liver", {-0.04, -0.04, 0}, {0.04, 0.04, kLiverSurface}, {7, 7, 6}));
  hold(scene.bodies[1], [](const Eigen::Vector3d& x) { return x.z() == 0; });
  for (content::DeformableBody& body : scene.bodies) {
    for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      for (const int node : body.mesh.tets[t]) centre += 0.25 * body.mesh.nodes[node];
      body.tet_tissue[t] = tissue_at(centre);
    }
  }
  scene.targets.push_back({.name = "tumour", .centre = {0, 0, kTumourTop - kTumourRadius}, .radius = kTumourRadius});

  constexpr double kSpeed = 0.040, kAbove = 0.005;
  const double end = kTumourTop - kTumourRadius;
  const double way = kSkinSurface + kAbove - end;
  const Eigen::Quaterniond down(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  for (const auto& [t, z] : {std::pair{0.0, end + way}, std::pair{way / kSpeed, end}, std::pair{2.0, end}}) {
    scene.motion.stylus.push_back(
        {.time_s = t, .pose = {.position = {0.0007, 0.0011, z + scene.needle.length}, .orientation = down}});
  }
  return scene;
}

}  // namespace stylet::tests
