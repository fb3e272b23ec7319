#include "tools/reference/image_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace stylet::reference {
namespace {

double mean_power(std::span<const double> amplitude) {
  double sum = 0;
  for (const double a : amplitude) sum += a * a;
  return sum / static_cast<double>(amplitude.size());
}

/// Mean product of `image` with itself `lag` rows further down.
double autocovariance(const Eigen::MatrixXd& image, Eigen::Index lag) {
  const Eigen::Index rows = image.rows() - lag;
  return image.topRows(rows).cwiseProduct(image.bottomRows(rows)).sum() / static_cast<double>(rows * image.cols());
}

constexpr int kLanczos = 4;  ///< half width of the interpolating kernel, samples

/// The image `shift` rows (-1..1) further down, interpolated by Lanczos' windowed sinc; kLanczos rows less at either
/// end.
Eigen::MatrixXd shifted_rows(const Eigen::MatrixXd& image, double shift) {
  const auto sinc = [](double x) { return x == 0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); };
  const Eigen::Index rows = image.rows() - 2 * kLanczos;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows, image.cols());
  double weights = 0;
  for (int k = -kLanczos; k <= kLanczos; ++k) {
    const double x = k - shift;
    if (std::abs(x) >= kLanczos) continue;
    const double weight = sinc(x) * sinc(x / kLanczos);
    sum += weight * image.middleRows(kLanczos + k, rows);
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

Moments moments(std::span<const double> values) {
  Moments m;
  for (const double v : values) m.mean += v;
  m.mean /= static_cast<double>(values.size());
  for (const double v : values) m.deviation += (v - m.mean) * (v - m.mean);
  m.deviation = std::sqrt(m.deviation / static_cast<double>(values.size()));
  return m;
}

SpeckleStatistics speckle_statistics(std::span<const double> amplitude) {
  std::vector<double> intensity, logarithm;
  intensity.reserve(amplitude.size());
  logarithm.reserve(amplitude.size());
  for (const double a : amplitude) {
    intensity.push_back(a * a);
    logarithm.push_back(20 * std::log10(a));
  }
  const Moments linear = moments(amplitude), power = moments(intensity);
  return {.signal_to_noise = linear.mean / linear.deviation,
          .log_deviation_db = moments(logarithm).deviation,
          .nakagami_m = power.mean * power.mean / (power.deviation * power.deviation)};
}

double rayleigh_signal_to_noise(double looks) {
  // A Nakagami variable of shape `looks` and unit power.
  const double mean = std::exp(std::lgamma(looks + 0.5) - std::lgamma(looks)) / std::sqrt(looks);
  return mean / std::sqrt(1 - mean * mean);
}

double rayleigh_distance(std::span<const double> amplitude) {
  std::vector<double> sorted(amplitude.begin(), amplitude.end());
  std::ranges::sort(sorted);
  const double power = mean_power(sorted);
  const auto n = static_cast<double>(sorted.size());
  double distance = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double law = 1 - std::exp(-sorted[i] * sorted[i] / power);
    const auto below = static_cast<double>(i);
    distance = std::max({distance, law - below / n, (below + 1) / n - law});
  }
  return (distance - 0.2 / n) * (std::sqrt(n) + 0.26 + 0.5 / std::sqrt(n));
}

Eigen::MatrixXd without_depth_trend(const Patch& amplitude) {
  return amplitude.array().colwise() / amplitude.rowwise().mean().array();
}

double speckle_width(const Patch& intensity, Axis axis) {
  Eigen::MatrixXd image = intensity.array() - intensity.mean();
  if (axis == Axis::lateral) image.transposeInPlace();
  const double half = 0.5 * autocovariance(image, 0);
  double before = 2 * half;
  for (Eigen::Index lag = 1; lag < image.rows(); ++lag) {
    const double value = autocovariance(image, lag);
    if (value <= half) {
      // A Gaussian through the two neighbours, whose logarithm is linear in the square of the lag; a straight line
      // where the second one is below nothing.
      const auto at = static_cast<double>(lag);
      if (value <= 0) return 2 * (at - (half - value) / (before - value));
      const double share = std::log(before / half) / std::log(before / value);
      return 2 * std::sqrt((at - 1) * (at - 1) + share * (2 * at - 1));
    }
    before = value;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Line fit_line(std::span<const double> x, std::span<const double> y) {
  const double mean_x = moments(x).mean, mean_y = moments(y).mean;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  return {.slope = xy / xx, .level = mean_y - xy / xx * mean_x};
}

double decibels(double power_ratio) {
  return 10 * std::log10(power_ratio);
}

double contrast_db(std::span<const double> inside, std::span<const double> outside) {
  return decibels(mean_power(inside) / mean_power(outside));
}

double generalised_contrast(std::span<const double> inside, std::span<const double> outside) {
  constexpr int kBins = 100;
  const double high = std::max(*std::ranges::max_element(inside), *std::ranges::max_element(outside));
  if (!(high > 0)) return 0;
  const auto histogram = [&](std::span<const double> values) {
    std::vector<double> share(kBins, 0.0);
    for (const double v : values) {
      const int bin = std::clamp(static_cast<int>(kBins * v / high), 0, kBins - 1);
      share[bin] += 1.0 / static_cast<double>(values.size());
    }
    return share;
  };
  const std::vector<double> a = histogram(inside), b = histogram(outside);
  double overlap = 0;
  for (std::size_t bin = 0; bin < a.size(); ++bin) overlap += std::min(a[bin], b[bin]);
  return 1 - overlap;
}

Eigen::Vector2d echo_centre(const Patch& amplitude) {
  const double half = 0.5 * amplitude.maxCoeff();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double power = 0;
  for (Eigen::Index column = 0; column < amplitude.cols(); ++column) {
    for (Eigen::Index row = 0; row < amplitude.rows(); ++row) {
      const double a = amplitude(row, column);
      if (a < half) continue;
      const double weight = a * a - half * half;  // nothing at the threshold: a sample more or less does not matter
      sum += weight * Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row));
      power += weight;
    }
  }
  return sum / power;
}

double correlation(const Patch& a, const Patch& b) {
  const Eigen::ArrayXXd x = a.array() - a.mean();
  const Eigen::ArrayXXd y = b.array() - b.mean();
  const double norm = std::sqrt((x * x).sum() * (y * y).sum());
  return norm > 0 ? (x * y).sum() / norm : 0;
}

Match track(const Patch& first, const Patch& second, const Eigen::Vector2i& centre, const Eigen::Vector2i& half,
            int reach) {
  // More than the reach, to interpolate.
  const Eigen::Array2i low = centre.array() - half.array() - reach - kLanczos;
  const Eigen::Array2i high = centre.array() + half.array() + reach + kLanczos;
  if ((low < 0).any() || high.x() >= std::min(first.cols(), second.cols()) ||
      high.y() >= std::min(first.rows(), second.rows())) {
    throw std::invalid_argument("track: the window leaves the image; take a smaller one, or less reach");
  }
  const auto window = [&](const Patch& image, int column, int row) {
    return image.block(centre.y() + row - half.y(), centre.x() + column - half.x(), 2 * half.y() + 1,
                       2 * half.x() + 1);
  };
  const Eigen::MatrixXd wanted = window(first, 0, 0);
  const auto value = [&](int column, int row) { return correlation(wanted, window(second, column, row)); };
  Eigen::Vector2i best(0, 0);
  double peak = -1;
  for (int row = -reach; row <= reach; ++row) {
    for (int column = -reach; column <= reach; ++column) {
      const double c = value(column, row);
      if (c > peak) peak = c, best = {column, row};
    }
  }
  Match match{.shift = best.cast<double>(), .correlation = peak};
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2i step = axis == 0 ? Eigen::Vector2i(1, 0) : Eigen::Vector2i(0, 1);
    const double before = value(best.x() - step.x(), best.y() - step.y());
    const double after = value(best.x() + step.x(), best.y() + step.y());
    const double curvature = before - 2 * peak + after;
    if (!(curvature < 0)) continue;  // on the rim of what was looked at
    match.shift[axis] += 0.5 * (before - after) / curvature;
  }
  const Eigen::Vector2d part = match.shift - best.cast<double>();
  const Eigen::MatrixXd around =
      second.block(centre.y() + best.y() - half.y() - kLanczos, centre.x() + best.x() - half.x() - kLanczos,
                   wanted.rows() + 2 * kLanczos, wanted.cols() + 2 * kLanczos);
  match.correlation =
      correlation(wanted, shifted_rows(shifted_rows(around, part.y()).transpose(), part.x()).transpose());
  return match;
}

}  // namespace stylet::reference
