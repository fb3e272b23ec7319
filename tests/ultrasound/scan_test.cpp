// The parts of the image chain that can be checked without an image.
#include "engine/files/error.h"
#include "engine/ultrasound/beam_profile.h"
#include "engine/ultrasound/plane_slice.h"
#include "engine/ultrasound/scan_geometry.h"
#include "engine/ultrasound/scan_model.h"
#include "engine/ultrasound/speckle_field.h"
#include "engine/ultrasound/voxel_words.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace stylet::ultrasound {
namespace {

TEST(ScanGeometry, FirstAndLastSampleOfTheMiddleLineLieOnTheAxis) {
  content::Probe probe;
  probe.scan_lines = 191;  // odd: line 95 is the middle
  const ScanGeometry scan = ScanGeometry::of(probe, 1);
  EXPECT_LT((scan.position(95, -0.5) - Eigen::Vector2d(0, 0)).norm(), 1e-12);
  EXPECT_LT((scan.position(95, probe.samples - 0.5) - Eigen::Vector2d(0, probe.depth)).norm(), 1e-12);
}

TEST(ScanGeometry, ConvexLinesStartOnACircleAndSpanTheFieldOfView) {
  const content::Probe probe;
  const ScanGeometry scan = ScanGeometry::of(probe, 2);
  const Eigen::Vector2d centre(0, -probe.radius);
  for (double line : {-0.5, 100.0, scan.lines - 0.5}) {
    EXPECT_NEAR((scan.position(line, -0.5) - centre).norm(), probe.radius, 1e-12);
  }
  const Eigen::Vector2d first = scan.position(-0.5, 100) - centre;
  const Eigen::Vector2d last = scan.position(scan.lines - 0.5, 100) - centre;
  EXPECT_NEAR(std::acos(first.normalized().dot(last.normalized())), probe.field_of_view, 1e-9);
  EXPECT_GT(last.x(), 0);  // the last line is at the picture's right
}

TEST(ScanGeometry, LineAndSampleInvertPosition) {
  content::Probe probe;
  for (const bool convex : {true, false}) {
    probe.convex = convex;
    const ScanGeometry scan = ScanGeometry::of(probe, 2);
    for (double line : {0.0, 17.3, 383.0}) {
      for (double sample : {0.0, 200.7, 511.0}) {
        const Eigen::Vector2d back = scan.line_and_sample(scan.position(line, sample));
        EXPECT_NEAR(back.x(), line, 1e-9);
        EXPECT_NEAR(back.y(), sample, 1e-9);
      }
    }
  }
}

TEST(SectorGeometry, ShowsEverySampleAndUsesThePicture) {
  const content::Probe probe;
  const ScanGeometry scan = ScanGeometry::of(probe, 1);
  const SectorGeometry sector = SectorGeometry::fit(scan, 640, 480);
  double right = 0;
  for (double line : {-0.5, scan.lines / 2.0, scan.lines - 0.5}) {
    for (double sample : {-0.5, scan.samples - 0.5}) {
      const Eigen::Vector2d uv = sector.pixel(scan.position(line, sample));
      EXPECT_GT(uv.x(), 0);
      EXPECT_LT(uv.x(), 639);
      EXPECT_GT(uv.y(), 0);
      EXPECT_LT(uv.y(), 479);
      right = std::max(right, uv.x());
    }
  }
  EXPECT_GT(right, 0.9 * 640);
  EXPECT_LT((sector.position(sector.pixel({0.01, 0.02})) - Eigen::Vector2d(0.01, 0.02)).norm(), 1e-12);
}

TEST(BeamProfile, WidensWithDepthBeyondTheFocusAndNarrowsTowardsIt) {
  const double wavelength = 1540 / 3.5e6;
  EXPECT_LT(lateral_fwhm(0.070, wavelength), lateral_fwhm(0.150, wavelength));
  const content::Probe probe;
  EXPECT_LT(elevation_fwhm(probe, 0.070), elevation_fwhm(probe, 0.010));
  EXPECT_LT(elevation_fwhm(probe, 0.070), elevation_fwhm(probe, 0.150));
  EXPECT_LT(axial_fwhm(0.02), axial_fwhm(0.15));
  // F/2.2 at 3.5 MHz resolves about a millimetre.
  EXPECT_NEAR(lateral_fwhm(0.070, wavelength), 1.11e-3, 0.02e-3);
}

TEST(SpeckleField, IsCircularGaussianWithUnitVariance) {
  const SpeckleField field(3);
  for (int channel = 0; channel < 6; ++channel) {
    double sum = 0;
    double squares = 0;
    double fourth = 0;
    for (std::size_t i = 0; i < kSpeckleTexels; ++i) {
      const std::complex<float> both = field.look(channel / 2, i);
      const double v = channel % 2 == 0 ? both.real() : both.imag();
      sum += v;
      squares += v * v;
      fourth += v * v * v * v;
    }
    const double n = kSpeckleTexels;
    EXPECT_NEAR(sum / n, 0, 0.02) << channel;
    EXPECT_NEAR(squares / n, 1, 0.02) << channel;
    EXPECT_NEAR(fourth / squares / squares * n, 3, 0.15) << channel;  // kurtosis of a normal distribution
  }
  double real_imaginary = 0;
  double look_look = 0;
  for (std::size_t i = 0; i < kSpeckleTexels; ++i) {
    const std::complex<float> first = field.look(0, i);
    real_imaginary += double(first.real()) * double(first.imag());
    look_look += double(first.real()) * double(field.look(1, i).real());
  }
  EXPECT_NEAR(real_imaginary / kSpeckleTexels, 0, 0.03);
  EXPECT_NEAR(look_look / kSpeckleTexels, 0, 0.03);
}

/// Correlation of look 0 with itself a number of cells away along x, over a block of space many boxes wide.
double correlation(const SpeckleField& field, int shift) {
  double sum = 0;
  double squares = 0;
  for (int z = -100; z < 100; z += 3) {
    for (int y = -100; y < 100; y += 3) {
      for (int x = -150; x < 150; ++x) {
        const double a = field.look(0, SpeckleField::texel({x, y, z})).real();
        sum += a * double(field.look(0, SpeckleField::texel({x + shift, y, z})).real());
        squares += a * a;
      }
    }
  }
  return sum / squares;
}

TEST(SpeckleField, IsCorrelatedOverItsWidthAndNeverRepeats) {
  const SpeckleField field(3);
  // A Gaussian falls to 1/2 at half its width; of cells that far apart, few lie in two boxes.
  const double ratio = 2 * double(kSpeckleSpacing) / double(kSpeckleFwhm);
  for (const int shift : {1, 3, 5}) {
    EXPECT_NEAR(correlation(field, shift), std::exp2(-ratio * ratio * shift * shift), 0.05) << shift;
  }
  EXPECT_NEAR(correlation(field, 16), 0, 0.03);
  EXPECT_NEAR(correlation(field, kSpeckleSize), 0, 0.05);
}

TEST(SpeckleField, FollowsItsSeed) {
  const SpeckleField field(3);
  EXPECT_EQ(field.texels, SpeckleField(3).texels);
  EXPECT_NE(field.texels, SpeckleField(4).texels);
}

TEST(PlaneSlice, FindsEveryPointOfADeformedBlockWhereItWasAtRest) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  test::make_deformable(scene, 5);
  state::FrameState state = test::at_rest(scene);
  Eigen::Matrix3f shear;
  shear << 1.05F, 0.1F, -0.05F, 0.02F, 0.95F, 0.1F, -0.03F, 0.06F, 0.98F;
  const Eigen::Vector3f shift(0.003F, -0.002F, 0.001F);
  for (Eigen::Vector3f& p : state.bodies[0]) p = shear * p + shift;
  const ScanGeometry scan = ScanGeometry::of(scene.probe, 1);
  PlaneSlice slice(scan, scene.bodies);
  slice.cut(state, Eigen::Isometry3f::Identity());

  const Eigen::Matrix3f back = shear.inverse();
  int found = 0;
  for (int line = 60; line < 130; line += 7) {
    for (int sample = 20; sample < 450; sample += 11) {
      const Eigen::Vector2f p = scan.position(line, sample).cast<float>();
      const auto place = slice.find(p, line, sample);
      if (!place) continue;
      EXPECT_LT((place->position - back * (Eigen::Vector3f(p.x(), 0, p.y()) - shift)).norm(), 2e-6F);
      EXPECT_LT((place->slope - back.col(1)).norm(), 1e-3F);
      ++found;
    }
  }
  EXPECT_EQ(found, 10 * 40);
}

TEST(VoxelWords, KnowHowFarTheNextTissueIs) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  content::LabelVolume& labels = scene.labels;
  labels.size = {23, 17, 19};
  const auto at = [&](int x, int y, int z) { return (z * 17 + y) * 23 + x; };
  labels.labels.assign(static_cast<std::size_t>(at(22, 16, 18)) + 1, test::kBackground);
  labels.bodies.assign(labels.labels.size(), -1);
  labels.labels[at(4, 5, 6)] = test::kFluid;
  labels.bodies[at(15, 11, 9)] = content::kBreathes;  // another owner, the same tissue
  const std::vector<std::uint16_t> words = voxel_words(scene);
  const auto distance = [](const Eigen::Array3i& a, const Eigen::Array3i& b) { return (a - b).abs().maxCoeff(); };
  for (int z = 0; z < 19; ++z) {
    for (int y = 0; y < 17; ++y) {
      for (int x = 0; x < 23; ++x) {
        const Eigen::Array3i here(x, y, z);
        const int first = distance(here, {4, 5, 6}), second = distance(here, {15, 11, 9});
        const int expected = first == 0 || second == 0 ? 1 : std::min({first, second, 17});
        ASSERT_EQ(clearance_of(words[at(x, y, z)]), expected) << here.transpose();
      }
    }
  }
  EXPECT_EQ(label_of(words[at(4, 5, 6)]), int(test::kFluid));
  EXPECT_EQ(owner_of(words[at(15, 11, 9)]), static_cast<int>(scene.bodies.size()));
}

TEST(ScanModel, ListsEveryTileThatANeedleReaches) {
  const content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  ScanModel model(scene, {.line_oversampling = 1});
  state::FrameState state = test::at_rest(scene);
  const Eigen::Vector2d hub(-0.04, 0.01), tip(0.03, 0.11);
  test::place_needle(state, {-0.04F, 0.001F, 0.01F}, {0.03F, 0.001F, 0.11F});
  model.update(state);
  std::set<std::uint32_t> listed(model.thin_tiles().begin(), model.thin_tiles().end());
  const int columns = model.slice().columns();
  EXPECT_LT(listed.size(), static_cast<std::size_t>(columns * model.slice().rows()) / 4);
  // Five deviations of the echo across, and as far behind as its last copy comes.
  const double reach = 5 * double(kNeedleWidth);
  for (int l = 0; l < model.scan().lines; ++l) {
    for (int s = 0; s < model.scan().samples; ++s) {
      const Eigen::Vector2d back = model.scan().direction(l);
      bool reached = false;
      for (int copy = 0; copy <= kReverberations; ++copy) {
        const Eigen::Vector2d p = model.scan().position(l, s) - copy * scene.needle.outer_diameter * back;
        const double t = std::clamp((p - hub).dot(tip - hub) / (tip - hub).squaredNorm(), 0.0, 1.0);
        reached = reached || (p - hub - t * (tip - hub)).norm() < reach;
      }
      const auto tile = static_cast<std::uint32_t>(s / kTile * columns + l / kTile);
      ASSERT_TRUE(!reached || listed.contains(tile)) << l << ' ' << s;
    }
  }
}

TEST(ScanModel, AFiredNeedleReachesAheadOfItsTipWhileItIsOut) {
  const content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  ScanModel model(scene, {.line_oversampling = 1});
  state::FrameState state = test::at_rest(scene);
  test::place_needle(state, {0, 0, 0.01F}, {0, 0, 0.05F});
  state.cores = {{.fired_s = 5, .throw_length = 0.022F}};
  const auto whole_at = [&](double time_s) {
    state.time_s = time_s;
    model.update(state);
    double length = 0;
    for (const NeedleSegment& segment : model.needle()) length = std::max(length, double(segment.to.w));
    EXPECT_EQ(model.needle().front().from.w, 0) << "the tip's echo is the stylet's";
    return length;
  };
  const double shaft = whole_at(4.9);
  EXPECT_NEAR(whole_at(5.02), shaft + 0.022 / 4, 1e-6);
  EXPECT_NEAR(whole_at(5.3), shaft + 0.022, 1e-6);
  const vec4 tip = model.needle().front().from;
  EXPECT_NEAR(tip.z - state.needle_positions.back().z(), 0.022, 1e-6) << "straight ahead, in depth";
  EXPECT_EQ(whole_at(6), shaft);
}

TEST(ScanModel, TakesANeedleThatHasGoneWrong) {
  const content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  ScanModel model(scene, {.line_oversampling = 1});
  state::FrameState state = test::at_rest(scene);
  for (const float wrong :
       {1e15F, 1e30F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    test::place_needle(state, {0, 0, 0.01F}, {0, 0, 0.05F});
    state.needle_positions.back() = {wrong, 0, -wrong};
    state.bodies = test::at_rest(scene).bodies;
    if (!state.bodies.empty()) state.bodies[0][0] = {wrong, wrong, wrong};
    model.update(state);
    EXPECT_FALSE(model.needle().empty()) << wrong;  // what is sound of it is still seen
  }
}

TEST(ScanModel, RefusesScenesThatCannotBeImaged) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  content::Scene no_labels = scene;
  no_labels.labels = {};
  EXPECT_THROW(ScanModel(no_labels, {}), files::ContentError);
  content::Scene unknown_tissue = scene;
  unknown_tissue.labels.labels[17] = 200;
  EXPECT_THROW(ScanModel(unknown_tissue, {}), files::ContentError);
  content::Scene no_depth = scene;
  no_depth.probe.depth = 0;
  EXPECT_THROW(ScanModel(no_depth, {}), files::ContentError);
  EXPECT_THROW(ScanModel(scene, {.looks = 4}), files::ContentError);
}

}  // namespace
}  // namespace stylet::ultrasound
