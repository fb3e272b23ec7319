// A cyst that is drawn empty shrinks in the image, which is made of the deformed tetrahedra.
#include "engine/ultrasound/reference_image.h"
#include "physics/loops/simulation_loop.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace stylet::ultrasound {
namespace {

const Eigen::Vector3d kCystCentre(0, 0, 0.070);
constexpr double kCystRadius = 0.020;

content::Scene cyst_in_a_block() {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f& p) {
    if (p.z() < 0) return test::kOutside;
    return (p.cast<double>() - kCystCentre).norm() < kCystRadius ? test::kFluid : test::kBackground;
  });
  scene.probe.scan_lines = 96;
  scene.probe.samples = 384;
  test::make_deformable(scene, 12);
  return scene;
}

/// The block held at its faces, its ball of fluid a cavity.
physics::SimulationBody held_with_cavity(const content::DeformableBody& block) {
  physics::SimulationBody body;
  body.mesh = block.mesh;
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& x : body.mesh.nodes) bounds.extend(x);
  for (std::size_t n = 0; n < body.mesh.nodes.size(); ++n) {
    const Eigen::Vector3d& x = body.mesh.nodes[n];
    if ((x - bounds.min()).minCoeff() < 1e-9 || (bounds.max() - x).minCoeff() < 1e-9) {
      body.fixed_nodes.push_back(static_cast<int>(n));
    }
  }
  body.cavities.emplace_back();
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int n : body.mesh.tets[t]) centre += body.mesh.nodes[n] / 4;
    const bool fluid = (centre - kCystCentre).norm() < kCystRadius;
    body.tet_materials.push_back(fluid ? physics::ElasticMaterial{1e3, 0.45} : physics::ElasticMaterial{5e3, 0.3});
    if (fluid) body.cavities[0].push_back(static_cast<int>(t));
  }
  return body;
}

struct CystImage {
  double labelled = 0;  ///< area of fluid by the label map, m^2
  double black = 0;     ///< area near the cyst more than 20 dB below the liver beside it, m^2
  double behind = 0;    ///< mean power below the cyst over that of the liver beside it
};

CystImage look_at_cyst(ReferenceImager& imager, const state::FrameState& state) {
  imager.image(state);
  const SectorGeometry& picture = imager.geometry();
  CystImage seen;
  const double pixel = picture.metres_per_pixel * picture.metres_per_pixel;
  for (const std::uint8_t label : imager.label_map()) seen.labelled += label == test::kFluid ? pixel : 0;
  const ScanGeometry& scan = imager.scan();
  const auto amplitude = [&](int l, int s) {
    return imager.envelope()[static_cast<std::size_t>(s) * scan.lines + l];
  };
  int behind = 0;
  for (int s = 0; s + 1 < scan.samples; ++s) {
    double liver = 0;  // mean amplitude beside the cyst, as deep
    int beside = 0;
    for (int l = 0; l < scan.lines; ++l) {
      const double x = std::abs(scan.position(l, s).x());
      if (x < 1.5 * kCystRadius || x > 2.5 * kCystRadius) continue;
      liver += amplitude(l, s);
      ++beside;
    }
    if (beside < 10) continue;
    liver /= beside;
    for (int l = 0; l + 1 < scan.lines; ++l) {
      const Eigen::Vector2d p = scan.position(l, s);
      if ((p - Eigen::Vector2d(kCystCentre.x(), kCystCentre.z())).norm() < 1.4 * kCystRadius &&
          amplitude(l, s) < 0.1 * liver) {
        const Eigen::Vector2d across = scan.position(l + 1, s) - p;
        const Eigen::Vector2d down = scan.position(l, s + 1) - p;
        seen.black += std::abs(across.x() * down.y() - across.y() * down.x());
      }
      if (std::abs(p.x()) < 0.004 && p.y() > 0.100 && p.y() < 0.115) {
        seen.behind += std::pow(amplitude(l, s) / liver, 2);
        ++behind;
      }
    }
  }
  seen.behind /= behind;
  return seen;
}

TEST(Cavity, ShrinksInTheImageAsItIsDrawn) {
  const content::Scene scene = cyst_in_a_block();
  physics::SimulationLoop loop({held_with_cavity(scene.bodies[0])}, {});
  physics::TissuePatch patch = loop.make_patch();
  ReferenceImager imager(
      scene, {.width = 320, .height = 240, .looks = 1, .noise_db = -200, .haze = false, .depth_scale = false});
  state::FrameState state = test::at_rest(scene);
  const CystImage full = look_at_cyst(imager, state);

  double share = 1;
  physics::SimulationReport report;
  for (int i = 0; i < 60; ++i) {
    share = std::max(0.4, share - 0.02);
    report = loop.step({.cavity_shares = {&share, 1}}, patch);
    if (i % 5 == 0) loop.worker().step();
  }
  EXPECT_EQ(report.inverted_tets, 0);
  for (std::size_t n = 0; n < state.bodies[0].size(); ++n) {
    state.bodies[0][n] = loop.tissue().positions[0].col(static_cast<Eigen::Index>(n)).cast<float>();
  }
  const CystImage drained = look_at_cyst(imager, state);
  std::printf("  fluid %.0f -> %.0f mm2 (%.2f), black %.0f -> %.0f mm2 (%.2f); behind it %.1f -> %.1f dB\n",
              full.labelled * 1e6, drained.labelled * 1e6, drained.labelled / full.labelled, full.black * 1e6,
              drained.black * 1e6, drained.black / full.black, 10 * std::log10(full.behind),
              10 * std::log10(drained.behind));
  const double disc = std::numbers::pi * kCystRadius * kCystRadius;
  EXPECT_NEAR(full.labelled / disc, 1, 0.05);
  EXPECT_NEAR(full.black / disc, 1, 0.25) << "but for speckle's own dark spots, and echoes from the sides";
  // A ball of 0.4 of the volume has 0.54 of the section; this one is one of steps, in a mesh of 14 mm.
  const double section = std::pow(0.4, 2.0 / 3);
  EXPECT_NEAR(drained.labelled / full.labelled, section, 0.1);
  EXPECT_NEAR(drained.black / full.black, section, 0.15);
  EXPECT_LT(drained.behind, 0.8 * full.behind) << "less fluid, less enhancement";
}

}  // namespace
}  // namespace stylet::ultrasound
