#include "tests/ultrasound/phantom.h"

#include "physics/needle/needle.h"

#include <cmath>

namespace stylet::test {
namespace {

content::Tissue tissue(const char* name, double impedance, double attenuation, double backscatter_db,
                       double texture_db) {
  content::Tissue t;
  t.name = name;
  t.acoustics.impedance_rayl = impedance;
  t.acoustics.attenuation_db_per_cm_mhz = attenuation;
  t.acoustics.backscatter_db = backscatter_db;
  t.acoustics.texture_db = texture_db;
  return t;
}

constexpr float kSpacing = 0.001F;
constexpr float kHalfWidth = 0.08F;
constexpr float kHalfThickness = 0.03F;
constexpr float kTop = -0.012F;  ///< above the ends of a convex face
constexpr float kBottom = 0.17F;

}  // namespace

content::Scene block_phantom(const std::function<PhantomTissue(const Eigen::Vector3f&)>& shape) {
  content::Scene scene;
  scene.name = "phantom";
  scene.scenario = "phantom";
  scene.tissues = {tissue("outside", 429, 12, -90, 0),    tissue("background", 1.65e6, 0.5, 0, 0),
                   tissue("fluid", 1.60e6, 0.06, -60, 0), tissue("bone", 7.0e6, 10, -3, 0),
                   tissue("bright", 1.65e6, 0.5, 6, 0),   tissue("dark", 1.65e6, 0.5, -8, 0),
                   tissue("wall", 1.72e6, 0.7, 9, 0)};
  content::LabelVolume& labels = scene.labels;
  labels.spacing = kSpacing;
  labels.origin = {-kHalfWidth, -kHalfThickness, kTop};
  labels.size = {static_cast<int>(std::lround(2 * kHalfWidth / kSpacing)) + 1,
                 static_cast<int>(std::lround(2 * kHalfThickness / kSpacing)) + 1,
                 static_cast<int>(std::lround((kBottom - kTop) / kSpacing)) + 1};
  for (int k = 0; k < labels.size.z(); ++k) {
    for (int j = 0; j < labels.size.y(); ++j) {
      for (int i = 0; i < labels.size.x(); ++i) {
        labels.labels.push_back(shape(labels.origin + kSpacing * Eigen::Vector3f(float(i), float(j), float(k))));
      }
    }
  }
  labels.bodies.assign(labels.labels.size(), -1);
  scene.probe.name = "convex";
  return scene;
}

void make_deformable(content::Scene& scene, int cells) {
  content::DeformableBody body;
  body.name = "block";
  const Eigen::Vector3d low(-kHalfWidth, -kHalfThickness, kTop);
  const Eigen::Vector3d size(2 * kHalfWidth, 2 * kHalfThickness, kBottom - kTop);
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

content::Scene tour_phantom() {
  content::Scene scene = block_phantom([](const Eigen::Vector3f& p) {
    const auto disc = [&p](float x, float z) { return std::hypot(p.x() - x, p.z() - z); };
    if (p.z() < 0.003F) return kWall;
    if (p.z() < 0.016F) return kDark;
    if (disc(-0.045F, 0.020F) < 0.005F) return kBone;
    if (disc(0.032F, 0.060F) < 0.012F) return kFluid;
    if (disc(-0.005F, 0.095F) < 0.004F) return kFluid;
    if (disc(-0.005F, 0.095F) < 0.0055F) return kWall;
    if (disc(0.0F, 0.065F) < 0.010F) return kDark;
    if (p.z() > 0.135F + 0.02F * p.x() / 0.08F) return kBone;
    return kBackground;
  });
  scene.tissues[kBackground].acoustics.texture_db = 1.3;
  make_deformable(scene, 8);
  return scene;
}

state::FrameState tour_state(const content::Scene& scene) {
  state::FrameState state = at_rest(scene);
  place_needle(state, {-0.09F, 0.0F, 0.012F}, {-0.003F, 0.0F, 0.064F});
  return state;
}

}  // namespace stylet::test
