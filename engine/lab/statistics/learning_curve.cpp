#include "engine/lab/statistics/learning_curve.h"

#include <fmt/format.h>

#include <Eigen/QR>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace stylet::lab::statistics {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The curve without its plateau and height, which the last parameter bends.
double bend(CurveShape shape, double n, double c) {
  switch (shape) {
    case CurveShape::power:
    case CurveShape::power_above:
      return std::pow(n, -c);
    case CurveShape::hyperbolic:
      return 1 / (1 + (n - 1) / c);
    default:
      return std::exp(-(n - 1) / c);
  }
}

double bend_slope(CurveShape shape, double n, double c) {
  switch (shape) {
    case CurveShape::power:
    case CurveShape::power_above:
      return -std::log(n) * std::pow(n, -c);
    case CurveShape::hyperbolic:
      return (n - 1) / ((c + n - 1) * (c + n - 1));
    default:
      return (n - 1) / (c * c) * std::exp(-(n - 1) / c);
  }
}

double value_and_gradient(CurveShape shape, double n, const Eigen::VectorXd& p, Eigen::VectorXd& gradient) {
  switch (shape) {
    case CurveShape::constant:
      gradient[0] = 1;
      return p[0];
    case CurveShape::line:
      gradient[0] = 1;
      gradient[1] = n - 1;
      return p[0] + p[1] * (n - 1);
    case CurveShape::power:
      gradient[0] = bend(shape, n, p[1]);
      gradient[1] = p[0] * bend_slope(shape, n, p[1]);
      return p[0] * gradient[0];
    default:
      gradient[0] = 1;
      gradient[1] = bend(shape, n, p[2]);
      gradient[2] = p[1] * bend_slope(shape, n, p[2]);
      return p[0] + p[1] * gradient[1];
  }
}

/// Plateau and height that fit best, the bend given: where Levenberg and Marquardt begin.
std::vector<CurveParameter> begin_at(CurveShape shape, std::span<const double> values, const MetricRange& range,
                                     double c) {
  const bool plateau = shape != CurveShape::power;
  const auto n = static_cast<Eigen::Index>(values.size());
  Eigen::MatrixXd basis(n, plateau ? 2 : 1);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (plateau) basis(i, 0) = 1;
    basis(i, basis.cols() - 1) = bend(shape, static_cast<double>(i + 1), c);
    y[i] = values[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd best = basis.colPivHouseholderQr().solve(y);
  const bool exponent = shape == CurveShape::power || shape == CurveShape::power_above;
  std::vector<CurveParameter> parameters;
  if (plateau) parameters.push_back({best[0], range.low, range.high});
  parameters.push_back({best[best.size() - 1]});
  parameters.push_back({c, exponent ? 0.0 : 0.5, exponent ? 10.0 : 3 * static_cast<double>(n)});
  return parameters;
}

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

CurveFit fit_shape(CurveShape shape, std::span<const double> values, const MetricRange& range) {
  std::vector<double> attempts(values.size());
  std::iota(attempts.begin(), attempts.end(), 1.0);
  const CurveModel model = [shape](double n, const Eigen::VectorXd& p, Eigen::VectorXd& gradient) {
    return value_and_gradient(shape, n, p, gradient);
  };
  if (shape == CurveShape::constant || shape == CurveShape::line) {
    std::vector<CurveParameter> parameters{{mean_of(values)}};
    if (shape == CurveShape::line) parameters.push_back({0});
    return fit_curve(model, attempts, values, parameters);
  }
  // The sum of squares has valleys: begin in several.
  const bool exponent = shape == CurveShape::power || shape == CurveShape::power_above;
  const double n = static_cast<double>(values.size());
  const std::array<double, 4> bends = exponent ? std::array{0.1, 0.3, 1.0, 2.0} : std::array{1.0, n / 8, n / 2, n};
  CurveFit best;
  best.squares = kInfinite;
  for (const double c : bends) {
    CurveFit fit = fit_curve(model, attempts, values, begin_at(shape, values, range, c));
    if (fit.squares < best.squares) best = std::move(fit);
  }
  return best;
}

CurvePoint value_at(CurveShape shape, const CurveFit& fit, double attempt) {
  Eigen::VectorXd gradient(fit.parameters.size());
  const double value = value_and_gradient(shape, attempt, fit.parameters, gradient);
  return {.value = value, .standard_error = std::sqrt(gradient.dot(fit.covariance * gradient))};
}

std::optional<CurvePoint> attempts_to(const CurveFit& exponential, double level) {
  const double a = exponential.parameters[0];
  const double b = exponential.parameters[1];
  const double tau = exponential.parameters[2];
  const double share = b / (level - a);
  if (!(share > 0) || !std::isfinite(share)) return std::nullopt;
  const Eigen::Vector3d gradient{tau / (level - a), tau / b, std::log(share)};
  return CurvePoint{.value = 1 + tau * std::log(share),
                    .standard_error = std::sqrt(gradient.dot(exponential.covariance * gradient))};
}

LearningCurve learning_curve(std::span<const double> values, const MetricRange& range) {
  constexpr std::size_t kFewest = 8;
  constexpr double kBetter = 2;  // of AICc, than a constant
  if (values.size() < kFewest) {
    return {.refused = fmt::format("{} attempts are too few for a curve; it takes {}", values.size(), kFewest)};
  }
  const CurveFit fit = fit_shape(CurveShape::exponential, values, range);
  const CurveFit constant = fit_shape(CurveShape::constant, values, range);
  const CurveFit line = fit_shape(CurveShape::line, values, range);
  const double aicc = fit.aicc();
  if (!(aicc < constant.aicc() - kBetter)) return {.refused = "no learning is seen: a constant does as well"};
  if (!(aicc < line.aicc())) return {.refused = "no plateau is seen yet: a straight line does as well"};
  if (!fit.converged) return {.refused = "the fit did not settle"};
  if (fit.at_bound[0] || fit.at_bound[2]) {
    return {.refused = "the plateau is not within what the metric can be"};
  }
  const auto [least, most] = std::ranges::minmax(values);
  const double error = fit.standard_error(0);
  if (!(error <= (most - least) / 4)) return {.refused = "the plateau is not known well enough"};
  return {.exponential = fit};
}

std::vector<double> running_median(std::span<const double> values, int window) {
  std::vector<double> medians;
  medians.reserve(values.size());
  const auto half = static_cast<std::size_t>(window / 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t reach = std::min({half, i, values.size() - 1 - i});
    std::vector<double> around(values.begin() + static_cast<std::ptrdiff_t>(i - reach),
                               values.begin() + static_cast<std::ptrdiff_t>(i + reach + 1));
    std::nth_element(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(reach), around.end());
    medians.push_back(around[reach]);
  }
  return medians;
}

double shrunken_mean(double mean, int attempts, double group_mean, double sd_between, double sd_within) {
  const double between = sd_between * sd_between;
  const double weight = between / (between + sd_within * sd_within / attempts);
  return weight * mean + (1 - weight) * group_mean;
}

std::optional<double> retention_loss(std::span<const double> before, std::span<const double> after) {
  constexpr std::size_t kBefore = 5;
  constexpr std::size_t kAfter = 2;
  if (before.size() < kBefore || after.size() < kAfter) return std::nullopt;
  const std::span<const double> last = before.last(kBefore);
  const double mean = mean_of(last);
  double squares = 0;
  for (const double value : last) squares += (value - mean) * (value - mean);
  if (squares == 0) return std::nullopt;
  return (mean_of(after.first(kAfter)) - mean) / std::sqrt(squares / (kBefore - 1));
}

}  // namespace stylet::lab::statistics
