#include "tools/reference/ultrasound_phantom.h"

#include "physics/needle/needle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace stylet::reference {
namespace {

enum Label : std::uint8_t { kOutside, kBackground, kDense, kFluid, kRibBone, kFirstTarget };

constexpr double kImpedance = 1.65e6;
constexpr double kWireDb = 30;
constexpr double kWireGainDb = -10;  ///< 34 dB over the background are white
constexpr int kBodyCells = 12;

content::Tissue tissue(const char* name, double impedance, double attenuation, double backscatter_db) {
  content::Tissue t;
  t.name = name;
  t.acoustics = {.impedance_rayl = impedance,
                 .attenuation_db_per_cm_mhz = attenuation,
                 .backscatter_db = backscatter_db,
                 .texture_db = 0};
  return t;
}

/// The background, what differs from it as the obstacles do, then the grey targets.
std::vector<content::Tissue> phantom_tissues() {
  std::vector<content::Tissue> tissues{tissue("outside", 429, 12, -90),
                                       tissue("background", kImpedance, kBackgroundAttenuation, 0),
                                       tissue("dense", kImpedance, kDenseAttenuation, 0),
                                       tissue("fluid", 1.60e6, kFluidAttenuation, -60), tissue("rib", 7.0e6, 10, -3)};
  for (const GreyTarget& target : grey_targets()) {
    tissues.push_back(tissue("target", kImpedance, kBackgroundAttenuation, target.contrast_db));
  }
  return tissues;
}

/// Where nothing changes, large voxels do.
PhantomBlock plain_block() {
  return {.spacing = 0.002F};
}

std::uint8_t target_label(double x, double z) {
  for (std::size_t i = 0; i < grey_targets().size(); ++i) {
    if (grey_targets()[i].where.holds(x, z)) return static_cast<std::uint8_t>(kFirstTarget + i);
  }
  for (const Cylinder& cylinder : stepped_cylinders()) {
    if (cylinder.holds(x, z)) return kFirstTarget;
  }
  return kBackground;
}

void add_wires(content::Scene& scene, double half_length) {
  for (const Eigen::Vector2d& place : wire_places()) {
    scene.wires.push_back({.from = {place.x(), -half_length, place.y()},
                           .to = {place.x(), half_length, place.y()},
                           .echo_db = kWireDb});
  }
}

}  // namespace

content::Scene block_scene(std::vector<content::Tissue> tissues, const PhantomBlock& block,
                           const std::function<std::uint8_t(const Eigen::Vector3f&)>& shape) {
  content::Scene scene;
  scene.name = "phantom";
  scene.scenario = "phantom";
  scene.tissues = std::move(tissues);
  scene.probe.name = "convex";
  content::LabelVolume& labels = scene.labels;
  labels.spacing = block.spacing;
  labels.origin = block.low;
  labels.size = ((block.high - block.low) / block.spacing).array().round().cast<int>() + 1;
  labels.labels.reserve(labels.size.prod());
  for (int k = 0; k < labels.size.z(); ++k) {
    for (int j = 0; j < labels.size.y(); ++j) {
      for (int i = 0; i < labels.size.x(); ++i) {
        const Eigen::Vector3f at = labels.origin + labels.spacing * Eigen::Vector3f(float(i), float(j), float(k));
        const bool repeats = block.prism && j > 0;
        labels.labels.push_back(
            repeats ? labels.labels[labels.labels.size() - static_cast<std::size_t>(labels.size.x())] : shape(at));
      }
    }
  }
  labels.bodies.assign(labels.labels.size(), -1);
  return scene;
}

void make_deformable(content::Scene& scene, int cells) {
  content::DeformableBody body;
  body.name = "block";
  const content::LabelVolume& labels = scene.labels;
  const Eigen::Vector3d low = labels.origin.cast<double>();
  const Eigen::Vector3d size = (labels.size.array() - 1).cast<double>() * double(labels.spacing);
  const int n = cells + 1;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        body.mesh.nodes.push_back(low + size.cwiseProduct(Eigen::Vector3d(i, j, k)) / cells);
      }
    }
  }
  // Kuhn: the six tetrahedra along the diagonal of a cell, one for each order of the axes; odd orders swap two nodes.
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  const auto node = [n](const Eigen::Vector3i& p) { return (p.z() * n + p.y()) * n + p.x(); };
  for (int k = 0; k < cells; ++k) {
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        for (int order = 0; order < 6; ++order) {
          Eigen::Vector3i p(i, j, k);
          std::array<int, 4> tet{node(p)};
          for (int step = 0; step < 3; ++step) {
            p[kOrders[order][step]] += 1;
            tet[step + 1] = node(p);
          }
          if (order >= 3) std::swap(tet[1], tet[2]);
          body.mesh.tets.push_back(tet);
          body.tet_tissue.push_back(kBackground);
        }
      }
    }
  }
  scene.bodies = {body};
  scene.labels.bodies.assign(scene.labels.labels.size(), 0);
}

state::FrameState at_rest(const content::Scene& scene) {
  state::FrameState state;
  for (const content::DeformableBody& body : scene.bodies) {
    std::vector<Eigen::Vector3f>& nodes = state.bodies.emplace_back();
    for (const Eigen::Vector3d& p : body.mesh.nodes) nodes.push_back(p.cast<float>());
  }
  state.probe_position = scene.probe.pose.position.cast<float>();
  state.probe_orientation = scene.probe.pose.orientation.cast<float>();
  return state;
}

void place_needle(state::FrameState& state, const Eigen::Vector3f& hub, const Eigen::Vector3f& tip, int beams) {
  const Eigen::Quaternionf orientation = physics::orientation_along((tip - hub).cast<double>()).cast<float>();
  state.needle_positions.clear();
  for (int i = 0; i <= beams; ++i) {
    state.needle_positions.push_back(hub + (tip - hub) * (static_cast<float>(i) / static_cast<float>(beams)));
  }
  state.needle_orientations.assign(state.needle_positions.size(), orientation);
}

bool Cylinder::holds(double at_x, double at_z, double margin) const {
  return std::hypot(at_x - x, at_z - z) < radius - margin;
}

const std::vector<GreyTarget>& grey_targets() {
  static const std::vector<GreyTarget> targets = [] {
    std::vector<GreyTarget> all;
    double x = -0.050;
    for (const double contrast : {kAnechoicDb, -6.0, -3.0, 3.0, 6.0}) {
      const double radius = contrast == kAnechoicDb ? 0.004 : 0.006;  // grey ones hold enough speckle to be measured
      all.push_back({.where = {.x = x, .z = 0.070, .radius = radius}, .contrast_db = contrast});
      x += 0.025;
    }
    return all;
  }();
  return targets;
}

const std::vector<Cylinder>& stepped_cylinders() {
  static const std::vector<Cylinder> cylinders = [] {
    std::vector<Cylinder> all;
    double diameter = 0.003;
    for (int i = 0; i < 5; ++i) {
      all.push_back({.x = -0.030 + 0.015 * i, .z = 0.040, .radius = diameter / 2});
      diameter *= std::sqrt(1.5);
    }
    all.push_back({.x = 0, .z = 0.120, .radius = 0.005});
    return all;
  }();
  return cylinders;
}

std::vector<Eigen::Vector2d> wire_places() {
  std::vector<Eigen::Vector2d> places;
  for (int z = 10; z <= 150; z += 10) places.emplace_back(0.010, 1e-3 * z);
  for (int x = -60; x <= 60; x += 20) places.emplace_back(1e-3 * x, 0.090);
  return places;
}

content::Scene uniform_phantom() {
  content::Scene scene =
      block_scene(phantom_tissues(), plain_block(), [](const Eigen::Vector3f&) { return kBackground; });
  make_deformable(scene, kBodyCells);
  return scene;
}

content::Scene zone_phantom() {
  return block_scene(phantom_tissues(), plain_block(),
                     [](const Eigen::Vector3f& p) { return p.x() < 0 ? kBackground : kDense; });
}

content::Scene wire_phantom() {
  content::Scene scene =
      block_scene(phantom_tissues(), plain_block(), [](const Eigen::Vector3f&) { return kBackground; });
  add_wires(scene, 0.02);
  scene.probe.gain_db = kWireGainDb;
  return scene;
}

content::Scene target_phantom() {
  return block_scene(phantom_tissues(), {},
                     [](const Eigen::Vector3f& p) { return target_label(double(p.x()), double(p.z())); });
}

content::Scene obstacle_phantom() {
  return block_scene(phantom_tissues(), {}, [](const Eigen::Vector3f& p) -> std::uint8_t {
    if (kRib.holds(double(p.x()), double(p.z()))) return kRibBone;
    return kFluidCylinder.holds(double(p.x()), double(p.z())) ? kFluid : kBackground;
  });
}

content::Scene whole_phantom() {
  content::Scene scene = block_scene(phantom_tissues(), {}, [](const Eigen::Vector3f& p) -> std::uint8_t {
    const double x = double(p.x()), z = double(p.z());
    const Cylinder rib{-0.042, 0.020, 0.005}, fluid{-0.045, 0.105, 0.010};
    if (rib.holds(x, z)) return kRibBone;
    if (fluid.holds(x, z)) return kFluid;
    const std::uint8_t target = target_label(x, z);
    return target == kBackground && x > 0.030 && z > 0.085 ? std::uint8_t{kDense} : target;
  });
  add_wires(scene, 0.02);
  return scene;
}

}  // namespace stylet::reference
