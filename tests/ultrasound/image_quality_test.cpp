// Is it an ultrasound image? Claims on virtual test objects, by the reference on the CPU. What the quality control of
// scanners measures (speckle, attenuation, contrast, motion) is in tests/bench/ultrasound_bench_test.cpp.
#include "engine/ultrasound/reference_image.h"
#include "tests/support/sanitized.h"
#include "tests/ultrasound/phantom.h"
#include "tools/reference/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

namespace stylet::ultrasound {
namespace {

using reference::decibels;
using test::PhantomTissue;

/// No receiver noise and no haze: what is left is tissue.
constexpr ImagerSettings kClean{.looks = 1, .noise_db = -200, .haze = false, .depth_scale = false};

/// Cases of a claim, each a picture or more: with a sanitizer, which takes seconds for one, the last alone.
template <typename Case>
std::vector<Case> cases(std::initializer_list<Case> all) {
  return {support::kSanitized ? all.end() - 1 : all.begin(), all.end()};
}

class PhantomImage {
public:
  PhantomImage(content::Scene scene, const ImagerSettings& settings = kClean)
      : scene_(std::move(scene)), imager_(scene_, settings), state_(test::at_rest(scene_)) {}

  state::FrameState& state() { return state_; }
  void make() { imager_.image(state_); }
  const std::vector<std::uint8_t>& picture() { return imager_.image(state_); }
  const ReferenceImager& imager() const { return imager_; }

  double amplitude(int line, int sample) const {
    return imager_.envelope()[static_cast<std::size_t>(sample) * imager_.scan().lines + line];
  }
  /// Mean power of the envelope over samples where `where` (x, z) holds.
  template <typename Where>
  double power(Where&& where) const {
    double sum = 0;
    int count = 0;
    for (int s = 0; s < imager_.scan().samples; ++s) {
      for (int l = 0; l < imager_.scan().lines; ++l) {
        const Eigen::Vector2d p = imager_.scan().position(l, s);
        if (!where(p)) continue;
        sum += amplitude(l, s) * amplitude(l, s);
        ++count;
      }
    }
    EXPECT_GT(count, 20);
    return sum / count;
  }
  /// Brightest pixel of the picture within the box, and the position of its centre of brightness, m.
  /// The gain must be low enough that nothing there is white.
  Eigen::Vector2d brightest(const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
    const std::vector<std::uint8_t>& grey = picture();
    const SectorGeometry& sector = imager_.geometry();
    const auto inside = [&](int u, int v) {
      const Eigen::Vector2d p = sector.position(Eigen::Vector2d(u, v));
      return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
    };
    int peak = 0;
    for (int v = 0; v < sector.height; ++v) {
      for (int u = 0; u < sector.width; ++u) {
        if (inside(u, v)) peak = std::max<int>(peak, grey[static_cast<std::size_t>(v) * sector.width + u]);
      }
    }
    EXPECT_GT(peak, 20);
    EXPECT_LT(peak, 255);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weights = 0;
    for (int v = 0; v < sector.height; ++v) {
      for (int u = 0; u < sector.width; ++u) {
        const int value = grey[static_cast<std::size_t>(v) * sector.width + u];
        if (!inside(u, v) || value < peak - 25) continue;
        const double weight = value - (peak - 26);
        sum += weight * sector.position(Eigen::Vector2d(u, v));
        weights += weight;
      }
    }
    return sum / weights;
  }

private:
  content::Scene scene_;
  ReferenceImager imager_;
  state::FrameState state_;
};

content::Scene uniform(PhantomTissue tissue) {
  return test::block_phantom([tissue](const Eigen::Vector3f&) { return tissue; });
}

/// Fluid seen with the gain turned down: bright echoes are not clipped.
content::Scene dimmed_fluid() {
  content::Scene scene = uniform(test::kFluid);
  scene.probe.gain_db = -50;
  return scene;
}

TEST(Geometry, PlaneInterfaceIsSeenAtItsDepth) {
  content::Scene scene =
      test::block_phantom([](const Eigen::Vector3f& p) { return p.z() < 0.0705F ? test::kFluid : test::kWall; });
  scene.tissues[test::kWall].acoustics.backscatter_db = -60;
  scene.probe.gain_db = -20;
  PhantomImage image(scene);
  // Voxels change from 70 to 71 mm: the surface is half-way.
  EXPECT_NEAR(image.brightest({-0.002, 0.03}, {0.002, 0.12}).y(), 0.0705, 0.5e-3);
}

TEST(Geometry, NeedleAcrossTheImageIsSeenAtItsNearSide) {
  PhantomImage image(dimmed_fluid());
  for (const float depth : cases({0.030F, 0.060F, 0.110F})) {
    test::place_needle(image.state(), {-0.07F, 0, depth}, {0.07F, 0, depth});
    const double radius = 0.635e-3;  // 18G
    EXPECT_NEAR(image.brightest({-0.003, 0.015}, {0.003, 0.14}).y(), double(depth) - radius, 0.5e-3);
  }
}

TEST(Geometry, NeedleThroughTheImageIsSeenAsAPointInItsPlace) {
  PhantomImage image(dimmed_fluid());
  for (const Eigen::Vector2d& at :
       cases({Eigen::Vector2d(0, 0.05), Eigen::Vector2d(0.03, 0.09), Eigen::Vector2d(-0.02, 0.13)})) {
    test::place_needle(image.state(), {float(at.x()), -0.028F, float(at.y())},
                       {float(at.x()), 0.028F, float(at.y())});
    const Eigen::Vector2d beam = (at + Eigen::Vector2d(0, 0.060)).normalized();
    const Eigen::Vector2d seen = image.brightest({-0.05, 0.02}, {0.05, 0.15});
    EXPECT_LT((seen - (at - 0.635e-3 * beam)).norm(), 0.5e-3) << at.transpose() << " seen " << seen.transpose();
  }
}

TEST(Needle, FadesOutOfThePlane) {
  PhantomImage image(uniform(test::kFluid));
  const auto level = [&](float y) {
    test::place_needle(image.state(), {-0.05F, y, 0.060F}, {0.05F, y, 0.060F});
    image.make();
    return decibels(image.power(
        [](const Eigen::Vector2d& p) { return std::abs(p.x()) < 0.01 && std::abs(p.y() - 0.0595) < 0.0005; }));
  };
  const double in_plane = level(0);
  EXPECT_LT(level(0.0015F), in_plane - 3);  // half the slice thickness: half the amplitude
  EXPECT_GT(level(0.0015F), in_plane - 9);
  EXPECT_LT(level(0.004F), in_plane - 25);
}

/// The shipped linear probe.
content::Scene with_linear_probe(content::Scene scene) {
  content::Probe& probe = scene.probe;
  probe.convex = false;
  probe.width = 0.040;
  probe.depth = 0.070;
  probe.frequency_hz = 6e6;
  probe.focus = 0.035;
  probe.f_number = 1.5;
  probe.elevation_width = 1.5e-3;
  probe.elevation_focus = 0.022;
  return scene;
}

// Theory: the pulse is c n / (2 f) long, n = 2.3 cycles; the beam is lambda F# wide.
TEST(Speckle, OfALinearProbeIsAsFineAsItsPulseAndItsAperture) {
  const content::Scene scene = with_linear_probe(uniform(test::kBackground));
  PhantomImage image(scene);
  image.make();
  const ScanGeometry& scan = image.imager().scan();
  for (const double range : {0.010, 0.022, 0.035, 0.050}) {
    const int first = int((range - 0.006) / scan.sample_pitch), rows = int(0.012 / scan.sample_pitch), edge = 12;
    Eigen::MatrixXd envelope(rows, scan.lines - 2 * edge);
    for (int s = 0; s < rows; ++s) {
      for (int l = 0; l < envelope.cols(); ++l) envelope(s, l) = image.amplitude(l + edge, first + s);
    }
    const Eigen::MatrixXd intensity = reference::without_depth_trend(envelope).cwiseAbs2();
    const double axial = reference::speckle_width(intensity, reference::Axis::axial) * scan.sample_pitch;
    const double lateral = reference::speckle_width(intensity, reference::Axis::lateral) * scan.line_pitch;
    const double wavelength = 1540 / 6e6, pulse = 2.3 * wavelength / 2;
    const double beam = lateral_fwhm(range, wavelength, scene.probe.focus, scene.probe.f_number);
    std::printf("%.0f mm: axial %.3f mm (pulse %.3f), lateral %.3f mm (beam %.3f), slice %.2f mm\n", 1e3 * range,
                1e3 * axial, 1e3 * pulse, 1e3 * lateral, 1e3 * beam, 1e3 * elevation_fwhm(scene.probe, range));
    EXPECT_LE(axial, 0.40e-3);
    EXPECT_GE(axial, 0.95 * pulse);
    EXPECT_NEAR(axial, axial_fwhm(range, wavelength), 0.2 * axial_fwhm(range, wavelength));
    EXPECT_NEAR(lateral, beam, 0.2 * beam);
  }
}

/// A needle of 80 mm about (0, 0, depth), so many degrees from square to the beam there.
void turn_needle(state::FrameState& state, double degrees, float depth = 0.060F) {
  const double a = degrees * double(EIGEN_PI) / 180;
  const Eigen::Vector3f axis(static_cast<float>(std::cos(a)), 0, static_cast<float>(std::sin(a)));
  const Eigen::Vector3f middle(0, 0, depth);
  test::place_needle(state, middle - 0.04F * axis, middle + 0.04F * axis);
}

TEST(Needle, DropsOutAsItsAngleToTheBeamGetsSteep) {
  PhantomImage image(uniform(test::kFluid));
  const auto level = [&](double degrees) {
    turn_needle(image.state(), degrees);
    image.make();
    const double slope = std::tan(degrees * double(EIGEN_PI) / 180),
                 across = std::cos(degrees * double(EIGEN_PI) / 180);
    return decibels(image.power([&](const Eigen::Vector2d& p) {
      return std::abs(p.x()) < 0.006 && std::abs((p.y() - 0.060 - slope * p.x()) * across + 0.635e-3) < 0.4e-3;
    }));
  };
  const double square = level(0);
  double before = square + 1e-9;
  for (const double degrees : cases({10.0, 20.0, 30.0, 45.0, 60.0})) {
    const double now = level(degrees);
    std::printf("%.0f degrees: %.1f dB\n", degrees, now - square);
    EXPECT_LT(now, before) << degrees;
    if (degrees == 20) {
      EXPECT_NEAR(now - square, -4.3, 3);
    }
    if (degrees == 45) {
      EXPECT_LT(now - square, -20);
    }
    if (degrees == 60) {
      EXPECT_LT(now - square, -33);
    }
    before = now;
  }
}

// Sound goes to and fro within the shaft: copies 2 d / c apart in time, one diameter in the image.
TEST(Needle, HasACometTailOfItsDiameterWhereItIsSquareToTheBeam) {
  const content::Scene scene = with_linear_probe(uniform(test::kFluid));
  PhantomImage image(scene);
  const auto profile = [&](double degrees) {
    turn_needle(image.state(), degrees, 0.030F);
    image.make();
    std::vector<double> along;
    for (int s = 0; s < image.imager().scan().samples; ++s) {
      along.push_back(image.amplitude(image.imager().scan().lines / 2, s));
    }
    return along;
  };
  const std::vector<double> along = profile(0);
  const auto top = static_cast<int>(std::ranges::max_element(along) - along.begin());
  std::vector<int> peaks;
  for (int s = top; s + 1 < static_cast<int>(along.size()) && peaks.size() <= kReverberations; ++s) {
    if (along[s] > along[s - 1] && along[s] >= along[s + 1] && along[s] > 1e-3 * along[top]) peaks.push_back(s);
  }
  ASSERT_EQ(peaks.size(), kReverberations + 1U);
  for (std::size_t i = 1; i < peaks.size(); ++i) {
    const double spacing = (peaks[i] - peaks[i - 1]) * image.imager().scan().sample_pitch;
    std::printf("copy %zu: %.2f mm behind the one before, %.1f dB\n", i, 1e3 * spacing,
                20 * std::log10(along[peaks[i]] / along[top]));
    EXPECT_NEAR(spacing, scene.needle.outer_diameter, image.imager().scan().sample_pitch);
    EXPECT_LT(along[peaks[i]], 0.75 * along[peaks[i - 1]]);
  }
  // At a slant its echoes go elsewhere.
  const std::vector<double> slanted = profile(50);
  const double tail = slanted[peaks[1]] / along[peaks[1]];
  EXPECT_LT(tail, 0.1);
}

TEST(Needle, TipIsBrightestWithItsBevelToTheBeam) {
  content::Scene scene = uniform(test::kFluid);
  scene.needle.bevel_force_ratio = 0.1;
  PhantomImage image(scene);
  const Eigen::Vector3f tip(0, 0, 0.060F), axis = Eigen::Vector3f(1, 0, 1).normalized();
  const auto level = [&](double roll) {
    test::place_needle(image.state(), tip - 0.05F * axis, tip);
    Eigen::Matrix3f turned;
    turned.col(2) = axis;
    turned.col(0) = Eigen::AngleAxisf(static_cast<float>(roll), axis) * Eigen::Vector3f(1, 0, -1).normalized();
    turned.col(1) = turned.col(2).cross(turned.col(0));
    for (Eigen::Quaternionf& q : image.state().needle_orientations) q = Eigen::Quaternionf(turned);
    image.make();
    return decibels(
        image.power([&](const Eigen::Vector2d& p) { return (p - Eigen::Vector2d(0, 0.0594)).norm() < 1e-3; }));
  };
  const double up = level(0), aslant = level(double(EIGEN_PI) / 4), aside = level(double(EIGEN_PI) / 2),
               down = level(double(EIGEN_PI));
  std::printf("bevel to the beam %.1f, at 45 degrees %.1f, aside %.1f, away %.1f dB\n", up, aslant, aside, down);
  EXPECT_GT(up, aslant + 1);
  EXPECT_GT(aslant, aside + 1);
  EXPECT_GT(up, aside + 4);
  EXPECT_NEAR(down, up, 0.1);
}

TEST(Needle, HasSideLobesBesideItAtItsRange) {
  PhantomImage image(uniform(test::kFluid));
  test::place_needle(image.state(), {0, -0.028F, 0.060F}, {0, 0.028F, 0.060F});
  image.make();
  const auto level = [&](double across, double behind) {
    const double a = across / 0.120;
    const Eigen::Vector2d at =
        (0.1194 + behind) * Eigen::Vector2d(std::sin(a), std::cos(a)) - Eigen::Vector2d(0, 0.060);
    return decibels(image.power([&](const Eigen::Vector2d& p) { return (p - at).norm() < 1e-3; }));
  };
  const double needle = level(0, 0), near = level(0.003, 0), far = level(0.006, 0);
  std::printf("arc 3 mm beside the needle %.1f dB, 6 mm %.1f, behind it %.1f\n", near - needle, far - needle,
              level(0.003, 0.003) - needle);
  EXPECT_NEAR(near - needle, -35, 5);
  EXPECT_LT(far, near - 4);
  EXPECT_LT(level(0.003, 0.003), near - 15);
}

TEST(Needle, IsWhiteOnlyNearSquareToTheBeam) {
  PhantomImage image(with_linear_probe(uniform(test::kBackground)));
  const auto white = [&](double degrees) {
    turn_needle(image.state(), degrees, 0.030F);
    image.state().needle_positions.back() = {0, 0, 0.030F};  // the tip in the picture
    for (std::size_t i = 0; i + 1 < image.state().needle_positions.size(); ++i) {
      image.state().needle_positions[i] =
          image.state().needle_positions[0] +
          (image.state().needle_positions.back() - image.state().needle_positions[0]) *
              (static_cast<float>(i) / static_cast<float>(image.state().needle_positions.size() - 1));
    }
    return std::ranges::count(image.picture(), std::uint8_t{255});
  };
  EXPECT_GT(white(0), 0);
  for (const double degrees : cases({40.0, 50.0, 60.0})) EXPECT_EQ(white(degrees), 0) << degrees;
}

// As scanners show a shaft in tissue: uneven along its length, white in places, with a tail that stands out of the
// liver.
TEST(Needle, IsUnevenAlongItsShaftAndItsTailIsSeenInLiver) {
  PhantomImage image(with_linear_probe(uniform(test::kBackground)), {.noise_db = -200, .haze = false});
  test::place_needle(image.state(), {-0.06F, 0, 0.030F}, {0.03F, 0, 0.030F});
  const std::vector<std::uint8_t> grey = image.picture();
  const ScanGeometry& scan = image.imager().scan();
  const double radius = 0.635e-3;
  const auto level = [&](int line, double range) {
    const int middle = int(range / scan.sample_pitch), half = int(0.3e-3 / scan.sample_pitch);
    double sum = 0;
    for (int s = middle - half; s <= middle + half; ++s) sum += std::pow(image.amplitude(line, s), 2);
    return decibels(sum / (2 * half + 1));
  };
  double sum = 0, sum2 = 0, tail = 0, liver = 0;
  int lines = 0;
  for (int l = 8; l < scan.lines - 8; ++l, ++lines) {
    const double shaft = level(l, 0.030 - radius);
    sum += shaft;
    sum2 += shaft * shaft;
    tail += level(l, 0.030 - radius + 2 * 1.27e-3);
    liver += level(l, 0.030 + 9e-3);
  }
  const double spread = std::sqrt(sum2 / lines - std::pow(sum / lines, 2));
  std::printf("shaft %.1f dB over liver, +- %.1f dB along it; second copy %.1f\n", (sum - liver) / lines, spread,
              (tail - liver) / lines);
  EXPECT_GT(spread, 2);
  EXPECT_LT(spread, 6);
  EXPECT_GT((tail - liver) / lines, 6);
  EXPECT_LT((tail - sum) / lines, -8);
  // Of the columns that it crosses it is white in some and not in others.
  const SectorGeometry& sector = image.imager().geometry();
  int white = 0, columns = 0;
  for (int u = 0; u < sector.width; ++u) {
    int most = -1;
    for (int v = 0; v < sector.height; ++v) {
      const Eigen::Vector2d p = sector.position(Eigen::Vector2d(u, v));
      if (std::abs(p.x()) < 0.018 && std::abs(p.y() - 0.030 + radius) < 1e-3) {
        most = std::max<int>(most, grey[static_cast<std::size_t>(v) * sector.width + u]);
      }
    }
    if (most < 0) continue;
    ++columns;
    white += most == 255 ? 1 : 0;
  }
  EXPECT_GT(white, columns / 10);
  EXPECT_LT(white, 9 * columns / 10);
}

TEST(Contact, WithoutItTheImageIsDark) {
  content::Scene scene = test::block_phantom(
      [](const Eigen::Vector3f& p) { return p.z() < 0.003F ? test::kOutside : test::kBackground; });
  PhantomImage image(scene);
  const auto deep = [](const Eigen::Vector2d& p) { return std::abs(p.x()) < 0.03 && p.y() > 0.06 && p.y() < 0.1; };
  image.make();  // 3 mm of gel
  const double coupled = image.power(deep);
  image.state().probe_position.z() = -0.030F;
  image.make();
  EXPECT_LT(decibels(image.power(deep) / coupled), -60);
}

TEST(MovedOrgan, LeavesFillerBehindAndTakesItsAnatomyAlong) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f& p) {
    return std::hypot(p.x(), p.z() - 0.060F) < 0.008F ? test::kFluid : test::kBackground;
  });
  test::make_deformable(scene, 6);
  PhantomImage image(scene);
  for (Eigen::Vector3f& p : image.state().bodies[0]) p.x() += 0.025F;
  image.make();
  const auto disc = [](double x) {
    return [x](const Eigen::Vector2d& p) { return (p - Eigen::Vector2d(x, 0.060)).norm() < 0.005; };
  };
  const double ring = image.power(disc(-0.025));
  EXPECT_NEAR(decibels(image.power(disc(0)) / ring), 0, 3);
  EXPECT_LT(decibels(image.power(disc(0.025)) / ring), -20);
  // The block's left edge came into view: where it was there is filler, darker than the block but not black.
  const double filler = image.power(
      [](const Eigen::Vector2d& p) { return p.x() > -0.075 && p.x() < -0.060 && p.y() > 0.07 && p.y() < 0.09; });
  EXPECT_LT(decibels(filler / ring), -3);
  EXPECT_GT(decibels(filler / ring), -25);
}

// A slab that goes with the breath: its echo comes from where it is, and fat fills the place that it has left.
TEST(Breath, TakesARigidOrganAlongAndLeavesFatBehind) {
  const auto in_slab = [](double z) { return z > 0.060 && z < 0.068; };
  content::Scene scene = test::block_phantom(
      [&](const Eigen::Vector3f& p) { return in_slab(p.z()) ? test::kBright : test::kBackground; });
  for (std::size_t i = 0; i < scene.labels.labels.size(); ++i) {
    if (scene.labels.labels[i] == test::kBright) scene.labels.bodies[i] = content::kBreathes;
  }
  const auto between = [](double from, double to) {
    return [=](const Eigen::Vector2d& p) { return std::abs(p.x()) < 0.03 && p.y() > from && p.y() < to; };
  };
  PhantomImage plain(test::block_phantom([](const Eigen::Vector3f&) { return test::kBackground; }));
  plain.make();
  PhantomImage out(scene);
  out.make();
  PhantomImage in(scene);
  in.state().breath = {0, 0, 0.012F};
  in.make();
  const auto over_plain = [&](const PhantomImage& image, double from, double to) {
    return decibels(image.power(between(from, to)) / plain.power(between(from, to)));
  };
  const double slab = over_plain(out, 0.061, 0.067), moved = over_plain(in, 0.073, 0.079);
  const double left = over_plain(in, 0.062, 0.066);  // away from the faces between tissue and fat
  std::printf("slab %.1f dB, moved %.1f dB, the place that it left %.1f dB\n", slab, moved, left);
  EXPECT_NEAR(slab, 6, 1);
  EXPECT_NEAR(moved, 6, 1);
  EXPECT_NEAR(left, kFillerBackscatterDb, 1.5);
}

}  // namespace
}  // namespace stylet::ultrasound
