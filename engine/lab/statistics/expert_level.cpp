#include "engine/lab/statistics/expert_level.h"

#include "engine/lab/statistics/normal.h"

#include <cmath>
#include <numeric>
#include <vector>

namespace stylet::lab::statistics {

namespace {

/// P(T <= t) of the noncentral t distribution: over the chi distribution of the sample's SD, by Simpson's rule.
double noncentral_t_cdf(double t, double freedom, double moved) {
  constexpr int kIntervals = 2000;
  const double top = 1 + 12 / std::sqrt(2 * freedom);  // SD of a sample, in SDs
  const double log_scale = std::log(2.0) + freedom / 2 * std::log(freedom / 2) - std::lgamma(freedom / 2);
  const auto integrand = [&](double s) {
    if (s <= 0) return freedom > 1 ? 0.0 : std::exp(log_scale) * normal_cdf(-moved);
    const double density = std::exp(log_scale + (freedom - 1) * std::log(s) - freedom * s * s / 2);
    return density * normal_cdf(t * s - moved);
  };
  const double h = top / kIntervals;
  double sum = integrand(0) + integrand(top);
  for (int i = 1; i < kIntervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * integrand(i * h);
  return sum * h / 3;
}

}  // namespace

GroupLevel group_level(std::span<const double> means) {
  const auto n = static_cast<double>(means.size());
  const double mean = std::accumulate(means.begin(), means.end(), 0.0) / n;
  double squares = 0;
  for (const double value : means) squares += (value - mean) * (value - mean);
  return {.mean = mean, .sd = std::sqrt(squares / (n - 1)), .people = static_cast<int>(means.size())};
}

GroupLevel trimmed_level(std::span<const double> means) {
  const GroupLevel all = group_level(means);
  std::vector<double> kept;
  for (const double value : means) {
    if (std::abs(value - all.mean) <= 2 * all.sd) kept.push_back(value);
  }
  return kept.size() < 2 ? all : group_level(kept);
}

double lenient_bar_error(int people) {
  return std::sqrt(1.0 / people + 4.0 / (2.0 * (people - 1)));
}

double tolerance_factor(int people, double share, double confidence) {
  const double root = std::sqrt(static_cast<double>(people));
  const double moved = normal_quantile(share) * root;
  double low = 0;
  double high = 1000;
  while (high - low > 1e-9) {
    const double k = (low + high) / 2;
    (noncentral_t_cdf(k * root, people - 1, moved) < confidence ? low : high) = k;
  }
  return (low + high) / 2;
}

std::optional<ContrastingGroups> contrasting_groups(const GroupLevel& lower, const GroupLevel& higher) {
  const auto difference = [&](double x) {  // of the log densities
    const double a = (x - lower.mean) / lower.sd;
    const double b = (x - higher.mean) / higher.sd;
    return (a * a - b * b) / 2 + std::log(lower.sd / higher.sd);
  };
  double low = lower.mean;
  double high = higher.mean;
  if (!(lower.sd > 0 && higher.sd > 0 && low < high) || difference(low) >= 0 || difference(high) <= 0) {
    return std::nullopt;
  }
  for (int k = 0; k < 200; ++k) {
    const double middle = (low + high) / 2;
    (difference(middle) < 0 ? low : high) = middle;
  }
  const double cut = (low + high) / 2;
  return ContrastingGroups{.cut = cut,
                           .false_pass = normal_cdf((lower.mean - cut) / lower.sd),
                           .false_fail = normal_cdf((cut - higher.mean) / higher.sd)};
}

}  // namespace stylet::lab::statistics
