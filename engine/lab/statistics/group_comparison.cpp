#include "engine/lab/statistics/group_comparison.h"

#include "engine/lab/statistics/normal.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <random>

namespace stylet::lab::statistics {

namespace {

/// P(U <= u) where nothing is tied: arrangements counted, N(u; n, m) = N(u - m; n - 1, m) + N(u; n, m - 1).
double exact_lower_tail(double u, std::size_t first, std::size_t second) {
  const std::size_t most = first * second;
  // counts[m][u] of the groups' sizes n, m; n goes up.
  std::vector<std::vector<double>> counts(second + 1, std::vector<double>(most + 1, 0));
  for (auto& row : counts) row[0] = 1;
  for (std::size_t n = 1; n <= first; ++n) {
    std::vector<std::vector<double>> next(second + 1, std::vector<double>(most + 1, 0));
    next[0][0] = 1;
    for (std::size_t m = 1; m <= second; ++m) {
      for (std::size_t v = 0; v <= n * m; ++v) next[m][v] = (v >= m ? counts[m][v - m] : 0) + next[m - 1][v];
    }
    counts = std::move(next);
  }
  const std::vector<double>& row = counts[second];
  const double all = std::accumulate(row.begin(), row.end(), 0.0);
  double tail = 0;
  for (std::size_t v = 0; v <= most && static_cast<double>(v) <= u; ++v) tail += row[v];
  return tail / all;
}

double mean_of(const PersonValues& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double pairs_won(std::span<const double> first, std::span<const double> second) {
  double u = 0;
  for (const double a : first) {
    for (const double b : second) u += a > b ? 1 : a == b ? 0.5 : 0;
  }
  return u;
}

/// A number below n, the same on every machine.
std::size_t drawn(std::mt19937_64& random, std::size_t n) {
  return static_cast<std::size_t>(random() % n);
}

}  // namespace

MannWhitney mann_whitney(std::span<const double> first, std::span<const double> second) {
  constexpr std::size_t kExact = 50;  // values of a group
  const auto n = static_cast<double>(first.size());
  const auto m = static_cast<double>(second.size());
  MannWhitney test{.u = pairs_won(first, second)};
  test.auc = test.u / (n * m);
  std::vector<double> all(first.begin(), first.end());
  all.insert(all.end(), second.begin(), second.end());
  std::ranges::sort(all);
  double ties = 0;  // sum of t^3 - t
  for (auto from = all.begin(); from != all.end();) {
    const auto to = std::upper_bound(from, all.end(), *from);
    const auto t = static_cast<double>(to - from);
    ties += t * t * t - t;
    from = to;
  }
  const double lower = std::min(test.u, n * m - test.u);
  if (ties == 0 && first.size() <= kExact && second.size() <= kExact) {
    test.p = std::min(1.0, 2 * exact_lower_tail(lower, first.size(), second.size()));
    return test;
  }
  const double variance = n * m / 12 * (n + m + 1 - ties / ((n + m) * (n + m - 1)));
  const double distance = std::max(0.0, n * m / 2 - lower - 0.5);  // with the correction for continuity
  test.p = variance > 0 ? 2 * normal_cdf(-distance / std::sqrt(variance)) : 1;
  return test;
}

double auc_standard_error(double auc, int first, int second) {
  const double q1 = auc / (2 - auc);
  const double q2 = 2 * auc * auc / (1 + auc);
  return std::sqrt((auc * (1 - auc) + (first - 1) * (q1 - auc * auc) + (second - 1) * (q2 - auc * auc)) /
                   (static_cast<double>(first) * second));
}

double separation(double auc) {
  return std::numbers::sqrt2 * normal_quantile(auc);
}

Interval auc_interval(std::span<const PersonValues> first, std::span<const PersonValues> second, int draws,
                      std::uint64_t seed) {
  std::vector<double> means_first;
  std::vector<double> means_second;
  for (const PersonValues& values : first) means_first.push_back(mean_of(values));
  for (const PersonValues& values : second) means_second.push_back(mean_of(values));
  std::mt19937_64 random(seed);
  std::vector<double> areas;
  std::vector<double> a(means_first.size());
  std::vector<double> b(means_second.size());
  for (int k = 0; k < draws; ++k) {
    for (double& value : a) value = means_first[drawn(random, a.size())];
    for (double& value : b) value = means_second[drawn(random, b.size())];
    areas.push_back(pairs_won(a, b) / static_cast<double>(a.size() * b.size()));
  }
  std::ranges::sort(areas);
  const auto at = [&](double share) {
    return areas[static_cast<std::size_t>(share * static_cast<double>(areas.size() - 1))];
  };
  return {.low = at(0.025), .high = at(0.975)};
}

}  // namespace stylet::lab::statistics
