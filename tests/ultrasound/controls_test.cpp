// What the knobs of the scanner do, measured on images of the reference chain.
#include "engine/files/error.h"
#include "engine/ultrasound/beam_profile.h"
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
  EXPECT_THROW(preset_from_name("cardiac"), files::ContentError);
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

/// Without noise and near-field haze, which do not come from the tissue.
ImagerSettings quiet() {
  ImagerSettings settings = preset_settings(Preset::raw);
  settings.noise_db = -200;
  settings.depth_scale = false;
  settings.width = 320;
  settings.height = 240;
  return settings;
}

/// Grey values of a band of rows around a depth on the axis, 20 mm wide.
std::vector<int> band(const ReferenceImager& imager, const std::vector<std::uint8_t>& image, double depth) {
  const SectorGeometry& g = imager.geometry();
  std::vector<int> greys;
  const auto v = static_cast<int>(std::lround(g.pixel({0, depth}).y()));
  const auto left = static_cast<int>(g.pixel({-0.01, depth}).x());
  const auto right = static_cast<int>(g.pixel({0.01, depth}).x());
  for (int u = left; u <= right; ++u) greys.push_back(image[static_cast<std::size_t>(v) * g.width + u]);
  return greys;
}

void expect_close(const std::vector<int>& a, const std::vector<int>& b, int tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

TEST(Controls, GainIsWhatStrongerScatterersWouldBe) {
  content::Scene scene = plain();
  const state::FrameState state = test::at_rest(scene);
  ReferenceImager louder(scene, quiet());
  ScannerControls controls = louder.controls();
  controls.gain_db = 7;
  EXPECT_EQ(louder.set_controls(controls), "");
  const std::vector<std::uint8_t> image = louder.image(state);
  scene.tissues[test::kBackground].acoustics.backscatter_db += 7;
  ReferenceImager stronger(scene, quiet());
  // The skin's echo does not scatter: below it.
  for (const double depth : {0.03, 0.08, 0.15}) {
    expect_close(band(louder, image, depth), band(stronger, stronger.image(state), depth), 2);
  }
}

TEST(Controls, TgcSliderAddsItsDecibelsAtItsDepth) {
  const content::Scene scene = plain();
  const state::FrameState state = test::at_rest(scene);
  ReferenceImager imager(scene, quiet());
  const ScannerControls flat = imager.controls();
  const auto with_gain = [&](double gain_db) {
    ScannerControls controls = flat;
    controls.gain_db = gain_db;
    imager.set_controls(controls);
    return imager.image(state);
  };
  const std::vector<std::uint8_t> none = with_gain(0);
  const std::vector<std::uint8_t> half = with_gain(4);
  const std::vector<std::uint8_t> whole = with_gain(8);
  ScannerControls controls = flat;
  controls.tgc_db[3] = 8;
  imager.set_controls(controls);
  const std::vector<std::uint8_t> image = imager.image(state);
  const double eighth = scene.probe.depth / 8;
  // Half a pixel of the picture is up to 0.2 dB of a slider's slope.
  expect_close(band(imager, image, 3.5 * eighth), band(imager, whole, 3.5 * eighth), 2);
  expect_close(band(imager, image, 3 * eighth), band(imager, half, 3 * eighth), 2);
  expect_close(band(imager, image, 4 * eighth), band(imager, half, 4 * eighth), 2);
  for (const double there : {0.5, 1.5, 2.5, 4.5, 5.5, 6.5, 7.5}) {
    expect_close(band(imager, image, there * eighth), band(imager, none, there * eighth), 2);
  }
  EXPECT_NE(none, half);
}

TEST(Controls, DepthChangesTheScaleAndLeavesThingsWhereTheyAre) {
  const Eigen::Vector2d centre(0.012, 0.045);
  const content::Scene scene = test::block_phantom([&](const Eigen::Vector3f& p) {
    return std::hypot(p.x() - centre.x(), p.z() - centre.y()) < 0.008 ? test::kFluid : test::kBackground;
  });
  ReferenceImager imager(scene, quiet());
  const double at_first = imager.geometry().metres_per_pixel;
  for (const double depth : {0.160, 0.080}) {
    ScannerControls controls = imager.controls();
    controls.depth = depth;
    imager.set_controls(controls);
    const std::vector<std::uint8_t> image = imager.image(test::at_rest(scene));
    const SectorGeometry& g = imager.geometry();
    EXPECT_NEAR(imager.scan().range(imager.scan().samples - 0.5), depth, 1e-9);
    double inside = 0, around = 0;
    int count = 0;
    for (double angle = 0; angle < 6.28; angle += 0.1) {
      const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
      const auto grey = [&](double r) {
        const Eigen::Vector2i uv = (g.pixel(centre + r * way).array() + 0.5).floor().cast<int>();
        return double(image[static_cast<std::size_t>(uv.y()) * g.width + uv.x()]);
      };
      inside += grey(0.005);
      around += grey(0.011);
      ++count;
    }
    EXPECT_LT(inside / count, 10) << depth;
    EXPECT_GT(around / count, 60) << depth;
  }
  EXPECT_LT(imager.geometry().metres_per_pixel, 0.7 * at_first);
}

/// Lines over which the intensity's autocovariance at `depth` falls to one half, both sides.
double lateral_width(const ReferenceImager& imager, double depth) {
  const ScanGeometry& scan = imager.scan();
  const auto middle = static_cast<int>(depth / scan.sample_pitch);
  constexpr int kRows = 24;
  double covariance[24] = {};
  for (int s = middle - kRows; s <= middle + kRows; ++s) {
    std::vector<double> intensity(static_cast<std::size_t>(scan.lines));
    double mean = 0;
    for (int l = 0; l < scan.lines; ++l) {
      const double a = imager.envelope()[static_cast<std::size_t>(s) * scan.lines + l];
      intensity[l] = a * a;
      mean += a * a / scan.lines;
    }
    for (int lag = 0; lag < 24; ++lag) {
      for (int l = 24; l + 24 < scan.lines; ++l) {
        covariance[lag] += (intensity[l] - mean) * (intensity[l + lag] - mean);
      }
    }
  }
  int lag = 1;
  while (lag < 23 && covariance[lag] > 0.5 * covariance[0]) ++lag;
  const double above = covariance[lag - 1] / covariance[0];
  const double below = covariance[lag] / covariance[0];
  return 2 * (lag - 1 + (above - 0.5) / (above - below));
}

TEST(Controls, FocusNarrowsTheBeamAtItsDepth) {
  content::Scene scene = plain();
  scene.probe.scan_lines = 384;
  scene.probe.depth = 0.08;
  ReferenceImager imager(scene, quiet());
  const double depth = 0.06;
  const auto width_with = [&](double focus) {
    ScannerControls controls = imager.controls();
    controls.focus = focus;
    imager.set_controls(controls);
    imager.image(test::at_rest(scene));
    return lateral_width(imager, depth);
  };
  const double near = width_with(depth);
  const double far = width_with(0.20);
  const double wavelength = 1540 / scene.probe.frequency_hz;
  const double theory = lateral_fwhm(depth, wavelength, 0.20) / lateral_fwhm(depth, wavelength, depth);
  ASSERT_GT(theory, 1.2);
  EXPECT_NEAR(far / near, theory, 0.15);
}

TEST(Controls, FrequencyShortensPulseAndBeam) {
  const double low = 1540 / 2e6;
  const double high = 1540 / 5e6;
  EXPECT_NEAR(lateral_fwhm(0.07, low) / lateral_fwhm(0.07, high), 2.5, 1e-6);
  EXPECT_NEAR(axial_fwhm(0, low) / axial_fwhm(0, high), 2.5, 1e-6);
}

TEST(Controls, AreLimitedToTheProbeAndSaySo) {
  const content::Probe probe;
  ScannerControls controls = ScannerControls::of(probe, 0);
  EXPECT_EQ(limit(controls, probe), "");
  EXPECT_EQ(controls, ScannerControls::of(probe, 0));
  controls.frequency_hz = 9e6;
  controls.depth = 2;
  controls.tgc_db[7] = -50;
  controls.focus = std::nan("");
  EXPECT_EQ(limit(controls, probe),
            "depth limited to 300 mm, frequency limited to 5 MHz, focus limited to 75 mm, TGC 8 limited to -20 dB");
  EXPECT_EQ(controls.focus, probe.focus);
}

/// A flat block whose skin is a plane below a linear probe's face.
content::Scene flat_skin(float skin) {
  content::Scene scene = test::block_phantom(
      [&](const Eigen::Vector3f& p) { return p.z() < skin ? test::kOutside : test::kBackground; });
  scene.probe.convex = false;
  scene.probe.width = 0.05;
  scene.probe.scan_lines = 64;
  scene.probe.samples = 256;
  return scene;
}

/// Mean square of the envelope of each line from 20 mm below the face on, dB.
std::vector<double> line_levels(const content::Scene& scene, const state::FrameState& state) {
  ReferenceImager imager(scene, quiet());
  imager.image(state);
  const ScanGeometry& scan = imager.scan();
  std::vector<double> levels;
  for (int l = 0; l < scan.lines; ++l) {
    double sum = 1e-30;
    for (int s = scan.samples / 2; s < scan.samples; ++s) {
      sum += std::pow(double(imager.envelope()[static_cast<std::size_t>(s) * scan.lines + l]), 2) / scan.samples;
    }
    levels.push_back(10 * std::log10(sum));
  }
  return levels;
}

TEST(ProbeContact, LiftedProbeIsDarkAndTheGelFilmIsNot) {
  const content::Scene scene = flat_skin(0.003F);
  state::FrameState state = test::at_rest(scene);
  const std::vector<double> on_skin = line_levels(scene, state);
  state.probe_lifted = 1;
  const std::vector<double> film = line_levels(scene, state);
  state.probe_position.z() -= 0.004F;  // 7 mm of air, less the film
  const std::vector<double> lifted = line_levels(scene, state);
  for (std::size_t l = 0; l < on_skin.size(); ++l) {
    EXPECT_NEAR(film[l], on_skin[l], 0.5);
    EXPECT_LT(lifted[l], on_skin[l] - 40);
  }
}

TEST(ProbeContact, ProbeTiltedHalfOffIsDarkOnThatSideOnly) {
  // Turned about the end of its face that touches: the gap grows by sin(40 degrees) along the face.
  const content::Scene scene = flat_skin(0.003F);
  state::FrameState state = test::at_rest(scene);
  const std::vector<double> flat = line_levels(scene, state);
  const float angle = 0.7F;
  state.probe_orientation = Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitY());
  state.probe_position = {-0.025F + 0.025F * std::cos(angle), 0, 0.003F - 0.025F * std::sin(angle)};
  const std::vector<double> tilted = line_levels(scene, state);
  // Gap along a line at x from the touching end: x tan(40 degrees). 18 mm at 21 mm.
  const double pitch = scene.probe.width / static_cast<double>(flat.size());
  for (std::size_t l = 0; l < flat.size(); ++l) {
    const double gap = (static_cast<double>(l) + 0.5) * pitch * std::tan(angle);
    if (gap < double(kCouplingDepth) - 0.005) {
      EXPECT_GT(tilted[l], flat[l] - 10) << l;
    }
    if (gap > double(kCouplingDepth) + 0.005) {
      EXPECT_LT(tilted[l], flat[l] - 40) << l;
    }
  }
}

TEST(ProbeContact, WithoutGelASmallGapIsDark) {
  content::Scene scene = flat_skin(0.004F);
  const state::FrameState state = test::at_rest(scene);
  const std::vector<double> with_gel = line_levels(scene, state);
  scene.probe.gel = false;
  const std::vector<double> dry = line_levels(scene, state);
  state::FrameState pressed = state;
  pressed.probe_position.z() += 0.004F;
  const std::vector<double> dry_contact = line_levels(scene, pressed);
  for (std::size_t l = 0; l < dry.size(); ++l) {
    EXPECT_LT(dry[l], with_gel[l] - 40);
    EXPECT_GT(dry_contact[l], with_gel[l] - 10);
  }
}

}  // namespace
}  // namespace stylet::ultrasound
