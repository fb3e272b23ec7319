#include "engine/lab/statistics/proportion.h"

#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace stylet::lab::statistics {

Interval wilson(int passes, int attempts, double z) {
  const double n = attempts;
  const double p = passes / n;
  const double middle = p + z * z / (2 * n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  const double scale = 1 + z * z / n;
  return {.low = (middle - half) / scale, .high = (middle + half) / scale};
}

double failure_bound(int passes, double confidence) {
  return 1 - std::pow(1 - confidence, 1.0 / passes);
}

double in_a_row_within(int k, int attempts, double pass_rate) {
  std::vector<double> run(static_cast<std::size_t>(k), 0);  // P(so many passes at the end, never k before)
  run[0] = 1;
  double reached = 0;
  for (int t = 0; t < attempts; ++t) {
    const double failed = (1 - pass_rate) * std::accumulate(run.begin(), run.end(), 0.0);
    reached += pass_rate * run.back();
    for (std::size_t i = run.size() - 1; i > 0; --i) run[i] = pass_rate * run[i - 1];
    run[0] = failed;
  }
  return reached;
}

}  // namespace stylet::lab::statistics
