// Is it an ultrasound image? Measured on virtual test objects, as a scanner's quality is measured on real ones. The
// oracles are the physics (Rayleigh statistics, two-way attenuation, geometry), not the code's constants.
#include "engine/ultrasound/reference_image.h"
#include "tests/support/sanitized.h"
#include "tests/ultrasound/phantom.h"
#include "tools/bench/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

namespace stylet::ultrasound {
namespace {

using bench::decibels;
using bench::Match;
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

/// Envelope over its mean at the same depth, in the middle of the image.
std::vector<double> detrended(const PhantomImage& image) {
  Eigen::MatrixXd middle(350, 200);
  for (int s = 0; s < 350; ++s) {
    for (int l = 0; l < 200; ++l) middle(s, l) = image.amplitude(92 + l, 100 + s);
  }
  const Eigen::MatrixXd flat = bench::without_depth_trend(middle);
  return {flat.data(), flat.data() + flat.size()};
}

TEST(Speckle, OfOneLookIsRayleigh) {
  PhantomImage image(uniform(test::kBackground));
  image.make();
  const bench::SpeckleStatistics s = bench::speckle_statistics(detrended(image));
  EXPECT_NEAR(s.signal_to_noise, bench::rayleigh_signal_to_noise(1), 0.10);
  EXPECT_NEAR(s.log_deviation_db, 5.57, 0.4);
}

TEST(Speckle, OfThreeLooksIsSmootherByTheRootOfThree) {
  ImagerSettings settings = kClean;
  settings.looks = 3;
  PhantomImage image(uniform(test::kBackground), settings);
  image.make();
  const double theory = bench::rayleigh_signal_to_noise(3);
  EXPECT_NEAR(bench::speckle_statistics(detrended(image)).signal_to_noise, theory, 0.08 * theory);
}

TEST(Attenuation, SlopeIsThatOfTheTissueAndLevelThatOfLiver) {
  for (const double alpha : cases({0.3, 0.5, 0.8})) {
    content::Scene scene = uniform(test::kBackground);
    scene.tissues[test::kBackground].acoustics.attenuation_db_per_cm_mhz = alpha;
    PhantomImage image(scene);
    image.make();
    std::vector<double> depth_cm, power_db;
    for (int s = 60; s < 460; ++s) {
      double power = 0;
      for (int l = 92; l < 292; ++l) power += image.amplitude(l, s) * image.amplitude(l, s) / 200;
      depth_cm.push_back(100 * image.imager().scan().range(s));
      power_db.push_back(decibels(power));
    }
    const bench::Line line = bench::fit_line(depth_cm, power_db);
    EXPECT_NEAR(-line.slope / (2 * 3.5), alpha, 0.05 * alpha);
    EXPECT_NEAR(line.level, 0, 1.0) << alpha;
  }
}

TEST(Contrast, AnechoicCystIsDarkAndWhatLiesBehindItBright) {
  const auto in_cyst = [](double x, double z, double radius) { return std::hypot(x, z - 0.060) < radius; };
  PhantomImage cyst(test::block_phantom(
      [&](const Eigen::Vector3f& p) { return in_cyst(p.x(), p.z(), 0.012) ? test::kFluid : test::kBackground; }));
  cyst.make();
  PhantomImage plain(uniform(test::kBackground));
  plain.make();
  const auto inside = [&](const Eigen::Vector2d& p) { return in_cyst(p.x(), p.y(), 0.009); };
  EXPECT_LT(decibels(cyst.power(inside) / plain.power(inside)), -20);
  const auto behind = [](const Eigen::Vector2d& p) {
    return std::abs(p.x()) < 0.003 && p.y() > 0.080 && p.y() < 0.110;
  };
  // 24 mm of fluid instead of tissue, there and back; the speckle behind is the same, so it cancels.
  const double enhancement = 2 * (0.5 - 0.06) * 3.5 * 2.4;
  EXPECT_NEAR(decibels(cyst.power(behind) / plain.power(behind)), enhancement, 1.0);
}

TEST(Contrast, GreyTargetsShowTheBackscatterTheyHave) {
  const auto target = [](double x, double centre) { return std::abs(x - centre) < 0.008; };
  PhantomImage image(test::block_phantom([&](const Eigen::Vector3f& p) {
    if (p.z() < 0.05 || p.z() > 0.09) return test::kBackground;
    return target(p.x(), -0.02) ? test::kBright : target(p.x(), 0.02) ? test::kDark : test::kBackground;
  }));
  image.make();
  PhantomImage plain(uniform(test::kBackground));
  plain.make();
  for (const auto& [x, contrast] : {std::pair{-0.02, 6.0}, std::pair{0.02, -8.0}}) {
    const auto inside = [centre = x](const Eigen::Vector2d& p) {
      return std::abs(p.x() - centre) < 0.0055 && p.y() > 0.055 && p.y() < 0.085;
    };
    EXPECT_NEAR(decibels(image.power(inside) / plain.power(inside)), contrast, 1.0);
  }
}

TEST(Shadow, OfARibIsDeepAndItsSurfaceBright) {
  const auto in_rib = [](double x, double z) { return std::hypot(x, z - 0.030) < 0.006; };
  PhantomImage rib(test::block_phantom(
      [&](const Eigen::Vector3f& p) { return in_rib(p.x(), p.z()) ? test::kBone : test::kBackground; }));
  rib.make();
  PhantomImage plain(uniform(test::kBackground));
  plain.make();
  const auto behind = [](const Eigen::Vector2d& p) {
    return std::abs(p.x()) < 0.003 && p.y() > 0.045 && p.y() < 0.120;
  };
  EXPECT_LT(decibels(rib.power(behind) / plain.power(behind)), -30);
  const auto surface = [](const Eigen::Vector2d& p) {
    return std::abs(p.x()) < 0.002 && std::abs(p.y() - 0.024) < 0.001;
  };
  EXPECT_GT(decibels(rib.power(surface) / plain.power(surface)), 10);
  const auto beside = [](const Eigen::Vector2d& p) {
    return p.x() > 0.03 && p.x() < 0.05 && p.y() > 0.05 && p.y() < 0.1;
  };
  EXPECT_NEAR(decibels(rib.power(beside) / plain.power(beside)), 0, 0.1);
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

TEST(Needle, FadesAsItTurnsIntoTheBeam) {
  PhantomImage image(uniform(test::kFluid));
  double last = 1e9;
  double first = 0;
  for (int degrees = 0; degrees <= 70; degrees += support::kSanitized ? 35 : 10) {
    // Through (0, 60 mm), where the beam is vertical; the tip is out of the way.
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector3f axis(static_cast<float>(std::cos(angle)), 0, static_cast<float>(std::sin(angle)));
    const Eigen::Vector3f middle(0, 0, 0.060F);
    test::place_needle(image.state(), middle - 0.05F * axis, middle + 0.04F * axis);
    image.make();
    const double level = decibels(image.power(
        [](const Eigen::Vector2d& p) { return std::abs(p.x()) < 0.001 && std::abs(p.y() - 0.060) < 0.003; }));
    EXPECT_LT(level, last) << degrees;
    if (degrees == 0) first = level;
    last = level;
  }
  EXPECT_LT(last, first - 15);
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

// ---- tissue motion
// -----------------------------------------------------------------------------------------------------

/// Where the window around `at` went, m.
Match track(const std::vector<std::uint8_t>& first, const std::vector<std::uint8_t>& second,
            const SectorGeometry& sector, const Eigen::Vector2d& at, double half_window) {
  using Grey = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto as_image = [&](const std::vector<std::uint8_t>& grey) -> Eigen::MatrixXd {
    return Eigen::Map<const Grey>(grey.data(), sector.height, sector.width).cast<double>();
  };
  const int half = static_cast<int>(half_window / sector.metres_per_pixel);
  Match match =
      bench::track(as_image(first), as_image(second), sector.pixel(at).array().round().cast<int>(), {half, half}, 9);
  match.shift *= sector.metres_per_pixel;
  return match;
}

class MovingTissue : public testing::Test {
protected:
  MovingTissue() : image_(deformable(), ImagerSettings{.noise_db = -200, .haze = false, .depth_scale = false}) {
    still_ = image_.picture();
  }
  static content::Scene deformable() {
    content::Scene scene = uniform(test::kBackground);
    test::make_deformable(scene, 6);
    return scene;
  }
  template <typename Move>
  Match moved(Move&& move, double half_window) {
    const state::FrameState rest = image_.state();
    for (Eigen::Vector3f& p : image_.state().bodies[0]) p = move(p);
    const Match match = track(still_, image_.picture(), image_.imager().geometry(), {0, 0.070}, half_window);
    image_.state() = rest;
    return match;
  }

  PhantomImage image_;
  std::vector<std::uint8_t> still_;
};

TEST_F(MovingTissue, TakesItsSpeckleAlong) {
  for (const Eigen::Vector2d& shift :
       cases({Eigen::Vector2d(0, 0.002), Eigen::Vector2d(0.002, 0), Eigen::Vector2d(-0.0011, 0.0017)})) {
    const Match match = moved(
        [&](const Eigen::Vector3f& p) -> Eigen::Vector3f {
          return p + Eigen::Vector3f(float(shift.x()), 0, float(shift.y()));
        },
        0.008);
    EXPECT_LT((match.shift - shift).norm(), 0.1e-3) << shift.transpose() << " tracked " << match.shift.transpose();
    EXPECT_GT(match.correlation, 0.9) << shift.transpose();
  }
}

TEST_F(MovingTissue, DecorrelatesWithStrain) {
  const auto compressed = [this](float strain) {
    return moved(
               [strain](const Eigen::Vector3f& p) -> Eigen::Vector3f {
                 return {p.x(), p.y(), p.z() - strain * (p.z() - 0.070F)};
               },
               0.004)
        .correlation;
  };
  const double three_percent = compressed(0.03F);
  const double ten_percent = compressed(0.10F);
  EXPECT_GT(three_percent, 0.85);
  EXPECT_LT(ten_percent, three_percent);
  EXPECT_GT(ten_percent, 0.3);
}

TEST_F(MovingTissue, DecorrelatesOutOfThePlane) {
  const auto shifted = [this](float y) {
    return moved([y](const Eigen::Vector3f& p) -> Eigen::Vector3f { return p + Eigen::Vector3f(0, y, 0); }, 0.008)
        .correlation;
  };
  const double half = shifted(0.0005F);
  const double two = shifted(0.002F);
  EXPECT_GT(half, 0.75);
  EXPECT_LT(two, 0.6);
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
