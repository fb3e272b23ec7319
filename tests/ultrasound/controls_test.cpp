// What the knobs of the scanner do, measured on images of the reference chain.
#include "engine/content/error.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/reference_image.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace stylet::ultrasound {
namespace {

content::Scene plain() {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; });
  scene.probe.scan_lines = 64;
  scene.probe.samples = 256;
  return scene;
}

/// Grey values are rounded; an S-curve leaves differences between values near its middle as they are.
double mean_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(int(a[i]) - int(b[i]));
  return sum / static_cast<double>(a.size());
}

TEST(Presets, HaveNames) {
  for (const Preset preset : {Preset::clinical, Preset::raw}) {
    EXPECT_EQ(preset_from_name(preset_name(preset)), preset);
  }
  EXPECT_THROW(preset_from_name("cardiac"), content::ContentError);
}

TEST(Presets, RawHasOneLineForEachOfTheProbeAndNoTexture) {
  content::Scene scene = plain();
  ReferenceImager raw(scene, preset_settings(Preset::raw));
  EXPECT_EQ(raw.scan().lines, scene.probe.scan_lines);
  raw.image(test::at_rest(scene));
  const std::vector<float> before = raw.envelope();
  scene.tissues[test::kBackground].acoustics.texture_db = 5;
  ReferenceImager still_raw(scene, preset_settings(Preset::raw));
  still_raw.image(test::at_rest(scene));
  EXPECT_EQ(still_raw.envelope(), before);
}

TEST(Persistence, ConvergesOnAStillImageAndStartsExact) {
  const content::Scene scene = plain();
  ImagerSettings settings = preset_settings(Preset::raw);
  ReferenceImager exact(scene, settings);
  settings.persistence = 0.6;
  ReferenceImager imager(scene, settings);
  const state::FrameState state = test::at_rest(scene);
  state::FrameState elsewhere = state;
  elsewhere.probe_position.y() += 0.01F;
  const std::vector<std::uint8_t> wanted = exact.image(state);
  EXPECT_EQ(imager.image(state), wanted);
  imager.image(elsewhere);
  double left = mean_difference(imager.image(state), wanted);
  EXPECT_GT(left, 2);
  for (int frame = 0; frame < 4; ++frame) {
    const double now = mean_difference(imager.image(state), wanted);
    EXPECT_NEAR(now / left, 0.6, 0.06);
    left = now;
  }
  imager.image(elsewhere);
  imager.restart();
  EXPECT_EQ(imager.image(state), wanted);
}

// y(n) = (1 - a) x(n) + a y(n - 1) of white noise x has the variance (1 - a) / (1 + a) of x.
TEST(Persistence, LeavesTheShareOfTheNoiseThatTheoryHas) {
  // Echoes far below the noise: what is shown is noise alone, the depth gain lifts it into the grey.
  content::Scene scene = plain();
  scene.tissues[test::kBackground].acoustics.backscatter_db = -200;
  scene.probe.samples = 64;
  scene.probe.dynamic_range_db = 120;
  ImagerSettings settings = preset_settings(Preset::raw);
  settings.depth_scale = false;
  settings.width = 128;
  settings.height = 96;
  const double a = 0.5;
  const auto variance_of = [&](double persistence) {
    settings.persistence = persistence;
    ReferenceImager imager(scene, settings);
    state::FrameState state = test::at_rest(scene);
    std::vector<double> sum;
    std::vector<double> squares;
    constexpr int kSettle = 10;
    constexpr int kFrames = 80;
    for (int frame = 0; frame < kSettle + kFrames; ++frame) {
      state.time_s = 0.04 * frame;
      const std::vector<std::uint8_t>& image = imager.image(state);
      sum.resize(image.size());
      squares.resize(image.size());
      for (std::size_t i = 0; frame >= kSettle && i < image.size(); ++i) {
        sum[i] += image[i];
        squares[i] += double(image[i]) * image[i];
      }
    }
    double total = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      total += squares[i] / kFrames - sum[i] * sum[i] / kFrames / kFrames;
    }
    return total;
  };
  EXPECT_NEAR(variance_of(a) / variance_of(0), (1 - a) / (1 + a), 0.03);
}

}  // namespace
}  // namespace stylet::ultrasound
