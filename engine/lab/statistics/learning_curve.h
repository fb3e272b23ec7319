// The learning curve of one person: a metric over the attempts of a scenario, fitted where the data carry it.
// Of individuals the exponential fits; a power law comes out of averaging exponentials (Heathcote, Brown, Mewhort,
// Psychon Bull Rev 7 (2000) 185). A fitted plateau is a description, never a promise and never a gate.
#pragma once

#include "engine/lab/statistics/curve_fit.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::lab::statistics {

/// y at attempt n = 1, 2, ...
enum class CurveShape : std::uint8_t {
  constant,     ///< a
  line,         ///< a + b (n - 1)
  power,        ///< b n^-c
  hyperbolic,   ///< a + b / (1 + (n - 1) / r)   (Thurstone 1919)
  exponential,  ///< a + b exp(-(n - 1) / tau)
  power_above,  ///< a + b n^-c
};

/// What a metric can be, in its unit or, of times, paths and counts + 1, the logarithm of it.
struct MetricRange {
  double low = 0;
  double high = 0;
};

/// Parameters in the order of CurveShape's formulas; a within `range`, tau and r within [0.5, 3 n].
/// @param values  by attempt; more than there are parameters
CurveFit fit_shape(CurveShape shape, std::span<const double> values, const MetricRange& range);

struct CurvePoint {
  double value = 0;
  double standard_error = 0;  ///< of the curve there, by the delta method
};
CurvePoint value_at(CurveShape shape, const CurveFit& fit, double attempt);

/// Attempts until the exponential is at `level`: 1 + tau ln(b / (level - a)), with its error by the delta method;
/// nothing: it never is.
std::optional<CurvePoint> attempts_to(const CurveFit& exponential, double level);

struct LearningCurve {
  std::optional<CurveFit> exponential{};
  std::string refused{};  ///< why there is none, a sentence
};

/// The exponential, or why not: fewer than 8 attempts, a constant or a line that does as well, a plateau that is not
/// known to a quarter of the values' range, or that leaves what the metric can be.
/// @param values  of one segment: same scenario, same definition of the metric, same kind of device
LearningCurve learning_curve(std::span<const double> values, const MetricRange& range);

/// Median of each value and its neighbors, `window` (odd) wide, narrower at the ends: what is shown without a fit.
std::vector<double> running_median(std::span<const double> values, int window = 5);

/// A person's mean, drawn toward the group's by what is known of it: w mean + (1 - w) group,
/// w = between^2 / (between^2 + within^2 / n).
double shrunken_mean(double mean, int attempts, double group_mean, double sd_between, double sd_within);

/// Change over a pause: mean of the first two values after it minus mean of the last five before, in standard
/// deviations of those five; nothing: too few of either, or five alike.
std::optional<double> retention_loss(std::span<const double> before, std::span<const double> after);

}  // namespace stylet::lab::statistics
