// What makes it look like a patient: mirror image, ringing froth, layers, walls, haze in fluids, anatomy beyond a
// cut.
#include "engine/ultrasound/reference_image.h"
#include "tests/support/sanitized.h"
#include "tests/ultrasound/phantom.h"
#include "tools/reference/image_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace stylet::ultrasound {
namespace {

using reference::decibels;

/// No noise, no haze, one look: what is left is tissue and gas.
constexpr ImagerSettings kBare{.looks = 1, .line_oversampling = 1, .noise_db = -200, .haze = false};

/// A linear probe: lines are columns, 0.4 mm apart, samples rows.
content::Scene linear(content::Scene scene) {
  scene.probe.convex = false;
  scene.probe.width = 0.05;
  scene.probe.scan_lines = 125;
  return scene;
}

class Envelope {
public:
  explicit Envelope(const content::Scene& scene, const ImagerSettings& settings = kBare) : imager_(scene, settings) {
    imager_.image(test::at_rest(scene));
  }
  double at(int line, int sample) const {
    return imager_.envelope()[static_cast<std::size_t>(sample) * imager_.scan().lines + line];
  }
  int lines() const { return imager_.scan().lines; }
  int sample(double range) const { return static_cast<int>(std::lround(range / imager_.scan().sample_pitch - 0.5)); }
  double sample_pitch() const { return imager_.scan().sample_pitch; }
  double line_pitch() const { return imager_.scan().line_pitch; }
  /// Mean power of all lines at these ranges, dB.
  double level(double from, double to) const { return level(from, to, 0, lines()); }
  double level(double from, double to, int first_line, int end_line) const {
    double sum = 0;
    for (int s = sample(from); s <= sample(to); ++s) {
      for (int l = first_line; l < end_line; ++l) sum += at(l, s) * at(l, s);
    }
    return decibels(sum / ((sample(to) - sample(from) + 1) * (end_line - first_line)));
  }

private:
  ReferenceImager imager_;
};

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

constexpr float kSurface = 0.060F;

TEST(Gas, ShowsTheMirrorImageOfWhatLiesInFront) {
  const content::Scene scene = linear(test::block_phantom([](const Eigen::Vector3f& p) {
    return p.z() > kSurface && p.z() < 0.150F ? test::kOutside : test::kBackground;
  }));
  const Envelope image(scene);
  // The voxels change half-way between two centres; the best mirror lies within one of that.
  double best = -1, at = 0;
  for (double plane = double(kSurface) - 1.5e-3; plane < double(kSurface) + 1.5e-3;
       plane += image.sample_pitch() / 2) {
    std::vector<double> front, behind;
    for (double away = 0.006; away < 0.020; away += image.sample_pitch()) {
      // Both over their depth's mean: they fade in opposite directions.
      const int before = image.sample(plane - away), after = image.sample(plane + away);
      const double level_before = image.level(plane - away, plane - away);
      const double level_after = image.level(plane + away, plane + away);
      for (int l = 10; l < image.lines() - 10; ++l) {
        front.push_back(image.at(l, before) * std::pow(10, -level_before / 20));
        behind.push_back(image.at(l, after) * std::pow(10, -level_after / 20));
      }
    }
    const double c = correlation(front, behind);
    if (c > best) best = c, at = plane;
  }
  std::vector<double> left, right;
  for (int s = image.sample(0.045); s < image.sample(0.055); ++s) {
    for (int l = 10; l < 50; ++l) left.push_back(image.at(l, s)), right.push_back(image.at(l + 60, s));
  }
  const double lower = image.level(0.045, 0.050) - image.level(0.070, 0.075);
  // 0.22 in the surface, 1/e in 25 mm, and the way back through liver of 0.5 dB/cm/MHz: 25 mm at 3.5 MHz.
  const double expected = 13.15 + 12.5 / 25 * 8.686 + 2 * 0.5 * 3.5 * 2.5;
  std::printf("mirrored at %.2f mm, correlation %.2f (elsewhere %.2f), %.1f dB lower (expected %.1f)\n", 1e3 * at,
              best, correlation(left, right), lower, expected);
  EXPECT_GT(best, 0.9);
  EXPECT_LT(std::abs(correlation(left, right)), 0.3);
  EXPECT_NEAR(at, double(kSurface) - 0.5e-3, 1e-3);
  EXPECT_NEAR(lower, expected, 2.0);
}

TEST(Gas, FrothRingsAndEachReverberationIsWeaker) {
  content::Scene scene = linear(
      test::block_phantom([](const Eigen::Vector3f& p) { return p.z() > kSurface ? test::kFroth : test::kFluid; }));
  const auto ring_of = [&](double ring_down) {
    scene.tissues[test::kFroth].acoustics.ring_down = ring_down;
    return Envelope(scene);
  };
  for (const double ring_down : support::kSanitized ? std::vector{0.7} : std::vector{0.7, 0.85}) {
    const Envelope image = ring_of(ring_down);
    // Where the first ring is, in the mean over lines: then a millimetre further each.
    const auto ring = [&](int n) { return image.level(0.0594 + 1e-3 * n, 0.0604 + 1e-3 * n); };
    const double per_ring = (ring(2) - ring(5)) / 3;
    std::printf("ring-down of %.2f: %.2f dB a reverberation\n", ring_down, -per_ring);
    EXPECT_NEAR(per_ring, -20 * std::log10(ring_down), 0.4);
  }
}

/// Distance at which the autocorrelation of the brightness (dB) falls to a half along lines and across them, m.
Eigen::Vector2d texture_length(double layering) {
  content::Scene scene = linear(
      test::block_phantom([](const Eigen::Vector3f& p) { return p.z() < -0.002F ? test::kOutside : test::kMuscle; }));
  scene.tissues[test::kMuscle].acoustics.layering = layering;
  scene.tissues[test::kMuscle].acoustics.septa_db = 0;
  scene.tissues[test::kMuscle].acoustics.texture_db = 6;
  ImagerSettings settings = kBare;
  settings.looks = 3;
  const Envelope image(scene, settings);
  const int first = image.sample(0.015), last = image.sample(0.045);
  const auto halved = [&](int dl, int ds, double pitch) {
    double before = 1;
    for (int lag = 1;; ++lag) {
      std::vector<double> a, b;
      for (int s = first; s < last; ++s) {
        for (int l = 0; l + lag * dl < image.lines(); ++l) {
          a.push_back(std::log(image.at(l, s)));
          b.push_back(std::log(image.at(l + lag * dl, s + lag * ds)));
        }
      }
      const double c = correlation(a, b);
      if (c < 0.4 || lag == 60) return pitch * (lag - 1 + (before - 0.4) / (before - c));
      before = c;
    }
  };
  return {halved(0, 1, image.sample_pitch()), halved(1, 0, image.line_pitch())};
}

TEST(Layers, AreLongerAlongTheSkinThanAcross) {
  const Eigen::Vector2d layered = texture_length(10);
  std::printf("layered: %.2f mm across, %.2f mm along\n", 1e3 * layered.x(), 1e3 * layered.y());
  EXPECT_GT(layered.y(), 3 * layered.x());
  if (support::kSanitized) return;
  const Eigen::Vector2d plain = texture_length(0);
  std::printf("isotropic: %.2f mm across, %.2f mm along\n", 1e3 * plain.x(), 1e3 * plain.y());
  EXPECT_GT(layered.y() / layered.x(), 2 * plain.y() / plain.x());
}

TEST(Walls, ThinnerThanTheSurfacesAreBright) {
  content::Scene scene = linear(test::block_phantom([](const Eigen::Vector3f& p) {
    return std::hypot(p.x(), p.z() - 0.040F) < 0.006F ? test::kFluid : test::kBackground;
  }));
  const auto ring_over_liver = [&] {
    const ImagerSettings settings = kBare;
    ReferenceImager imager(scene, settings);
    imager.image(test::at_rest(scene));
    double ring = 0, liver = 0;
    int in_ring = 0, in_liver = 0;
    for (int s = 0; s < imager.scan().samples; ++s) {
      for (int l = 0; l < imager.scan().lines; ++l) {
        const Eigen::Vector2d p = imager.scan().position(l, s) - Eigen::Vector2d(0, 0.040);
        const double power = std::pow(imager.envelope()[static_cast<std::size_t>(s) * imager.scan().lines + l], 2);
        // At the sides alone, where the echo of the interface is weak.
        if (std::abs(p.y()) > 0.5 * std::abs(p.x())) continue;
        if (p.norm() > 0.006 && p.norm() < 0.007) ring += power, ++in_ring;
        if (p.norm() > 0.010 && p.norm() < 0.014) liver += power, ++in_liver;
      }
    }
    return decibels(ring / in_ring / (liver / in_liver));
  };
  const double bare = ring_over_liver();
  scene.tissue_walls = {{.outside = test::kBackground, .inside = test::kFluid, .wall = test::kWall}};
  const double walled = ring_over_liver();
  std::printf("around the vessel: %.1f dB over liver, with a wall %.1f dB\n", bare, walled);
  EXPECT_LT(bare, 1);
  EXPECT_GT(walled, 3);
  EXPECT_GT(walled, bare + 4);
}

TEST(Fluid, IsHazyUnderItsFrontWall) {
  const content::Scene scene = linear(test::block_phantom(
      [](const Eigen::Vector3f& p) { return p.z() > 0.030F && p.z() < 0.070F ? test::kFluid : test::kBackground; }));
  ImagerSettings settings = kBare;
  const double clean = Envelope(scene, settings).level(0.033, 0.036);
  settings.haze = true;
  const Envelope image(scene, settings);
  const double liver = image.level(0.022, 0.028), near = image.level(0.033, 0.036),
               middle = image.level(0.050, 0.055);
  std::printf("fluid: %.1f dB under its wall (without clutter %.1f), %.1f in its middle, liver %.1f\n", near, clean,
              middle, liver);
  EXPECT_GT(near, clean + 10);
  EXPECT_GT(near, middle + 5);
  EXPECT_LT(near, liver - 20);
}

TEST(Cut, AnatomyGoesOnWhereThePatientEndsFlat) {
  const auto block = [](float end) {
    return linear(test::block_phantom([end](const Eigen::Vector3f& p) {
      return p.x() > end || p.z() < -0.004F ? test::kOutside : test::kBackground;
    }));
  };
  const Envelope whole(block(1));
  const Envelope cut(block(0.005F));
  const int line = 100;  // 15 mm to the right
  EXPECT_NEAR(cut.level(0.04, 0.06, line, 125), whole.level(0.04, 0.06, line, 125), 1.0);
  // But not towards the probe: there it ends at the skin.
  const content::Scene scene = block(1);
  ReferenceImager lifted(scene, kBare);
  state::FrameState state = test::at_rest(scene);
  state.probe_position.z() = -0.030F;
  lifted.image(state);
  float brightest = 0;
  for (const float value : lifted.envelope()) brightest = std::max(brightest, value);
  EXPECT_LT(brightest, 1e-3F);
}

}  // namespace
}  // namespace stylet::ultrasound
