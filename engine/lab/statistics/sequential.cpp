#include "engine/lab/statistics/sequential.h"

#include <algorithm>
#include <cmath>

namespace stylet::lab::statistics {

Weights monitoring_weights(const FailureRates& rates) {
  return {.pass = std::log((1 - rates.unacceptable) / (1 - rates.acceptable)),
          .fail = std::log(rates.unacceptable / rates.acceptable)};
}

Weights learning_weights(const FailureRates& rates) {
  const Weights weights = monitoring_weights(rates);
  return {.pass = -weights.pass, .fail = -weights.fail};
}

double odds_ratio(const FailureRates& rates) {
  return rates.unacceptable / (1 - rates.unacceptable) / (rates.acceptable / (1 - rates.acceptable));
}

double with_odds(double p, double ratio) {
  return ratio * p / (1 - p + ratio * p);
}

Weights monitoring_weights_by_risk(double p, double ratio) {
  const double share = std::log(1 - p + ratio * p);
  return {.pass = -share, .fail = std::log(ratio) - share};
}

Weights learning_weights_by_risk(double p, double ratio) {
  const Weights weights = monitoring_weights_by_risk(p, ratio);
  return {.pass = -weights.pass, .fail = -weights.fail};
}

std::vector<ChartPoint> run_chart(std::span<const double> weights, double limit, AfterSignal after) {
  std::vector<ChartPoint> chart;
  chart.reserve(weights.size());
  double sum = 0;
  for (const double weight : weights) {
    sum = std::max(0.0, sum + weight);
    const bool signal = sum >= limit - kSumTolerance;
    chart.push_back({.sum = sum, .signal = signal});
    if (signal && after == AfterSignal::restart) sum = 0;
  }
  return chart;
}

std::vector<ChartPoint> run_chart(const Weights& weights, std::span<const Outcome> outcomes, double limit,
                                  AfterSignal after) {
  std::vector<double> of_each;
  of_each.reserve(outcomes.size());
  for (const Outcome outcome : outcomes) of_each.push_back(weights.of(outcome));
  return run_chart(of_each, limit, after);
}

std::optional<int> first_signal(std::span<const ChartPoint> chart) {
  const auto found = std::ranges::find(chart, true, &ChartPoint::signal);
  if (found == chart.end()) return std::nullopt;
  return static_cast<int>(found - chart.begin()) + 1;
}

WaldLines wald_lines(const FailureRates& rates, double alpha, double beta) {
  const double p = std::log(rates.unacceptable / rates.acceptable);
  const double q = std::log((1 - rates.acceptable) / (1 - rates.unacceptable));
  return {.slope = q / (p + q),
          .upper = std::log((1 - beta) / alpha) / (p + q),
          .lower = std::log((1 - alpha) / beta) / (p + q)};
}

SprtBounds sprt_bounds(double alpha, double beta) {
  return {.accept = std::log((1 - beta) / alpha), .reject = std::log(beta / (1 - alpha))};
}

std::vector<double> smoothed_pass_rate(std::span<const Outcome> outcomes, double weight) {
  std::vector<double> rates;
  rates.reserve(outcomes.size());
  for (const Outcome outcome : outcomes) {
    const double y = outcome == Outcome::pass ? 1 : 0;
    rates.push_back(rates.empty() ? y : weight * y + (1 - weight) * rates.back());
  }
  return rates;
}

}  // namespace stylet::lab::statistics
