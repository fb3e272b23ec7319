// The measures of ultrasound quality, on synthetic data whose answers are known.
#include "tools/reference/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

namespace stylet::bench {
namespace {

class Random {
public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }
  /// Amplitude of a complex Gaussian number about `mean`.
  double amplitude(double power, double mean = 0) {
    const double s = std::sqrt(power / 2);
    return std::hypot(mean + s * normal(), s * normal());
  }
  std::vector<double> amplitudes(int count, double power, double mean = 0) {
    std::vector<double> values(static_cast<std::size_t>(count));
    for (double& v : values) v = amplitude(power, mean);
    return values;
  }

private:
  std::mt19937 engine_;
};

TEST(SpeckleStatistics, OfRayleighAmplitudesAreThoseOfTheory) {
  Random random(1);
  const reference::SpeckleStatistics s = reference::speckle_statistics(random.amplitudes(40'000, 3));
  EXPECT_NEAR(s.signal_to_noise, std::sqrt(std::numbers::pi / (4 - std::numbers::pi)), 0.02);
  EXPECT_NEAR(s.log_deviation_db, 5.57, 0.05);
  EXPECT_NEAR(s.nakagami_m, 1, 0.03);
  EXPECT_NEAR(reference::rayleigh_signal_to_noise(1), s.signal_to_noise, 0.02);
}

TEST(SpeckleStatistics, OfSeveralLooks) {
  Random random(2);
  std::vector<double> values;
  for (int i = 0; i < 40'000; ++i) {
    double intensity = 0;
    for (int look = 0; look < 3; ++look) intensity += std::pow(random.amplitude(1), 2) / 3;
    values.push_back(std::sqrt(intensity));
  }
  const reference::SpeckleStatistics s = reference::speckle_statistics(values);
  EXPECT_NEAR(s.signal_to_noise, reference::rayleigh_signal_to_noise(3), 0.03);
  EXPECT_NEAR(s.nakagami_m, 3, 0.1);
}

// The table of Stephens says how often: 5 in 100 above 1.094.
TEST(RayleighDistance, IsExceededAsOftenAsItsTableSays) {
  Random random(3);
  int above = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    above += reference::rayleigh_distance(random.amplitudes(100, 2)) > 1.094 ? 1 : 0;
  }
  std::printf("%.1f %% above the limit of 5 %%\n", 100.0 * above / kTrials);
  EXPECT_NEAR(above, 0.05 * kTrials, 4 * std::sqrt(0.05 * 0.95 * kTrials));
}

TEST(RayleighDistance, FindsACoherentEcho) {
  Random random(4);
  EXPECT_LT(reference::rayleigh_distance(random.amplitudes(1000, 1)), reference::kRayleighDistanceOfOnePercent);
  EXPECT_GT(reference::rayleigh_distance(random.amplitudes(1000, 1, 1.0)), reference::kRayleighDistanceOfOnePercent);
}

TEST(DepthTrend, IsDividedOut) {
  Eigen::MatrixXd image(3, 2);
  image << 1, 3, 10, 30, 0.5, 1.5;
  EXPECT_LT((reference::without_depth_trend(image) - Eigen::MatrixXd{{0.5, 1.5}, {0.5, 1.5}, {0.5, 1.5}}).norm(),
            1e-15);
}

/// Complex white noise behind a Gaussian point spread function, widths at half its amplitude. -> intensity
Eigen::MatrixXd speckle(Random& random, int rows, int columns, double axial, double lateral) {
  const auto kernel = [](double width) {
    const int reach = static_cast<int>(2 * width);
    std::vector<double> weights;
    for (int i = -reach; i <= reach; ++i)
      weights.push_back(std::exp(-4 * std::numbers::ln2 * i * i / (width * width)));
    return weights;
  };
  const std::vector<double> down = kernel(axial), across = kernel(lateral);
  const auto d = static_cast<int>(down.size()), a = static_cast<int>(across.size());
  Eigen::MatrixXcd noise(rows + d - 1, columns + a - 1);
  for (Eigen::Index i = 0; i < noise.size(); ++i) noise.data()[i] = {random.normal(), random.normal()};
  Eigen::MatrixXcd half = Eigen::MatrixXcd::Zero(rows, columns + a - 1);
  for (int i = 0; i < d; ++i) half += down[i] * noise.middleRows(i, rows);
  Eigen::MatrixXcd field = Eigen::MatrixXcd::Zero(rows, columns);
  for (int i = 0; i < a; ++i) field += across[i] * half.middleCols(i, columns);
  return field.cwiseAbs2();
}

TEST(SpeckleWidth, IsThatOfThePointSpreadFunction) {
  Random random(5);
  const Eigen::MatrixXd intensity = speckle(random, 600, 400, 6, 9);
  const double axial = reference::speckle_width(intensity, reference::Axis::axial),
               lateral = reference::speckle_width(intensity, reference::Axis::lateral);
  std::printf("6 x 9 samples: %.2f x %.2f\n", axial, lateral);
  EXPECT_NEAR(axial, 6, 0.3);
  EXPECT_NEAR(lateral, 9, 0.45);
  EXPECT_TRUE(std::isnan(reference::speckle_width(intensity.topRows(2), reference::Axis::axial)));
}

// As coarse as scanners sample along the beam: two samples in the width.
TEST(SpeckleWidth, IsFoundBetweenSamples) {
  Random random(9);
  for (const double width : {2.1, 2.5, 2.9}) {
    EXPECT_NEAR(reference::speckle_width(speckle(random, 500, 400, width, 4), reference::Axis::axial), width, 0.06)
        << width;
  }
}

TEST(Correlation, OfMixedSpeckleIsTheShareOfWhatIsCommon) {
  Random random(10);
  Eigen::MatrixXd common(100, 100), a = common, b = common;
  for (Eigen::Index i = 0; i < common.size(); ++i) {
    common.data()[i] = random.normal();
    a.data()[i] = 5 + common.data()[i];
    b.data()[i] = 3 - 0.6 * common.data()[i] + 0.8 * random.normal();
  }
  EXPECT_NEAR(reference::correlation(a, a), 1, 1e-12);
  EXPECT_NEAR(reference::correlation(a, b), -0.6, 0.03);
}

TEST(Line, GoesThroughItsPoints) {
  const std::vector<double> x{1, 2, 4}, y{1, 3, 7};
  const reference::Line line = reference::fit_line(x, y);
  EXPECT_NEAR(line.slope, 2, 1e-15);
  EXPECT_NEAR(line.level, -1, 1e-14);
}

TEST(Contrast, OfTwoKnownPowers) {
  Random random(6);
  const std::vector<double> bright = random.amplitudes(40'000, 4), dark = random.amplitudes(40'000, 1);
  EXPECT_NEAR(reference::contrast_db(bright, dark), 10 * std::log10(4.0), 0.1);
  // Intensities with exponential laws of means 1 and 4: their densities cross where x (1 - 1/4) = ln 4.
  const double cross = std::log(4.0) / 0.75;
  EXPECT_NEAR(reference::generalised_contrast(bright, dark), std::exp(-cross / 4) - std::exp(-cross), 0.015);
  EXPECT_LT(reference::generalised_contrast(dark, random.amplitudes(40'000, 1)), 0.03);
  const std::vector<double> black(100, 0.0), white(100, 1.0);
  EXPECT_EQ(reference::generalised_contrast(black, white), 1);
}

TEST(EchoCentre, IsFoundToAPartOfASample) {
  Eigen::MatrixXd image(40, 30);
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 30; ++column) {
      image(row, column) = std::exp(-(std::pow(column - 12.3, 2) + std::pow(row - 17.6, 2)) / 18);
    }
  }
  EXPECT_LT((reference::echo_centre(image) - Eigen::Vector2d(12.3, 17.6)).norm(), 0.02);
}

/// A random texture that can be drawn anywhere: plane waves of 6 to 12 samples.
class Texture {
public:
  explicit Texture(unsigned seed) : random_(seed) {
    for (int i = 0; i < 60; ++i) {
      const double angle = 2 * std::numbers::pi * random_.uniform();
      const double wave = 2 * std::numbers::pi / (6 + 6 * random_.uniform());
      waves_.push_back({wave * std::cos(angle), wave * std::sin(angle), 2 * std::numbers::pi * random_.uniform()});
    }
  }
  Eigen::MatrixXd moved(const Eigen::Vector2d& shift) const {
    Eigen::MatrixXd image(60, 60);
    for (int row = 0; row < 60; ++row) {
      for (int column = 0; column < 60; ++column) {
        double sum = 0;
        for (const Eigen::Vector3d& w : waves_) {
          sum += std::cos(w.x() * (column - shift.x()) + w.y() * (row - shift.y()) + w.z());
        }
        image(row, column) = sum;
      }
    }
    return image;
  }

private:
  Random random_;
  std::vector<Eigen::Vector3d> waves_;
};

// Half way between samples, two and a half of which make a speckle.
TEST(Track, CorrelatesBetweenSamples) {
  Random random(11);
  const Eigen::MatrixXd fine = speckle(random, 360, 360, 10, 10);
  const auto every_fourth = [&fine](int first) -> Eigen::MatrixXd {
    return fine(Eigen::seqN(first, 80, 4), Eigen::seqN(first, 80, 4));
  };
  const reference::Match match = reference::track(every_fourth(4), every_fourth(6), {40, 40}, {20, 20}, 5);
  EXPECT_LT((match.shift - Eigen::Vector2d(-0.5, -0.5)).norm(), 0.1) << match.shift.transpose();
  EXPECT_GT(match.correlation, 0.99);
}

TEST(Track, FindsAShiftToAPartOfASample) {
  const Texture texture(7);
  const Eigen::MatrixXd still = texture.moved({0, 0});
  for (const Eigen::Vector2d& shift :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(2.37, -1.61), Eigen::Vector2d(-5.5, 4)}) {
    const reference::Match match = reference::track(still, texture.moved(shift), {30, 28}, {10, 12}, 7);
    EXPECT_LT((match.shift - shift).norm(), 0.1) << shift.transpose() << " found " << match.shift.transpose();
    EXPECT_GT(match.correlation, 0.99);
  }
  EXPECT_LT(reference::track(still, Texture(8).moved({0, 0}), {30, 28}, {10, 12}, 7).correlation, 0.6);
  EXPECT_THROW(reference::track(still, still, {30, 28}, {10, 12}, 20), std::invalid_argument);
}

}  // namespace
}  // namespace stylet::bench
