#include "tests/ultrasound/phantom.h"

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

}  // namespace

content::Scene block_phantom(const std::function<PhantomTissue(const Eigen::Vector3f&)>& shape) {
  const reference::PhantomBlock block{
      .low = {-0.08F, -0.03F, -0.012F}, .high = {0.08F, 0.03F, 0.17F}, .spacing = 0.001F, .prism = false};
  content::Tissue muscle = tissue("muscle", 1.69e6, 0.96, -9, 2.5);
  muscle.acoustics.layering = 10;
  muscle.acoustics.septa_db = 8;
  content::Tissue froth = tissue("froth", 0.4e6, 3, -2, 0);
  froth.acoustics.ring_down = 0.7;
  return reference::block_scene(
      {tissue("outside", 429, 12, -90, 0), tissue("background", 1.65e6, 0.5, 0, 0),
       tissue("fluid", 1.60e6, 0.06, -60, 0), tissue("bone", 7.0e6, 10, -3, 0), tissue("bright", 1.65e6, 0.5, 6, 0),
       tissue("dark", 1.65e6, 0.5, -8, 0), tissue("wall", 1.72e6, 0.7, 9, 0), muscle, froth},
      block, [&shape](const Eigen::Vector3f& p) -> std::uint8_t { return shape(p); });
}

content::Scene tour_phantom() {
  content::Scene scene = block_phantom([](const Eigen::Vector3f& p) {
    const auto disc = [&p](float x, float z) { return std::hypot(p.x() - x, p.z() - z); };
    if (p.z() < -0.010F) return kOutside;
    if (p.z() < 0.003F) return kWall;
    if (p.z() < 0.016F) return kMuscle;
    if (disc(-0.045F, 0.020F) < 0.005F) return kBone;
    if (disc(0.032F, 0.060F) < 0.012F) return kFluid;
    if (disc(-0.005F, 0.095F) < 0.004F) return kFluid;
    if (disc(-0.030F, 0.085F) < 0.006F) return kFroth;
    if (disc(0.045F, 0.105F) < 0.010F) return kOutside;
    if (disc(0.0F, 0.065F) < 0.010F) return kDark;
    if (p.z() > 0.135F + 0.02F * p.x() / 0.08F) return kBone;
    return kBackground;
  });
  scene.tissues[kBackground].acoustics.texture_db = 1.3;
  scene.tissues[kBackground].acoustics.triads_db = 6;
  scene.tissue_walls = {{.outside = kBackground, .inside = kFluid, .wall = kWall}};
  make_deformable(scene, 8);
  return scene;
}

state::FrameState tour_state(const content::Scene& scene) {
  state::FrameState state = at_rest(scene);
  place_needle(state, {-0.09F, 0.0F, 0.012F}, {-0.003F, 0.0F, 0.064F});
  return state;
}

}  // namespace stylet::test
