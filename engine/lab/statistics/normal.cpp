#include "engine/lab/statistics/normal.h"

#include <cmath>
#include <numbers>

namespace stylet::lab::statistics {

double normal_density(double z) {
  return std::exp(-z * z / 2) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
}

double normal_cdf(double z) {
  return std::erfc(-z / std::numbers::sqrt2) / 2;
}

double normal_quantile(double p) {
  // Newton's steps, kept within a bracket: the tails are flat.
  double low = -40;
  double high = 40;
  double z = 0;
  for (int k = 0; k < 200; ++k) {
    const double error = normal_cdf(z) - p;
    (error > 0 ? high : low) = z;
    const double step = error / normal_density(z);
    const double newton = z - step;
    const double next = newton > low && newton < high ? newton : (low + high) / 2;
    if (std::abs(next - z) <= 1e-15 * (1 + std::abs(z))) return next;
    z = next;
  }
  return z;
}

}  // namespace stylet::lab::statistics
