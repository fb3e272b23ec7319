#include "engine/figures/plot_axis.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace stylet::figures {

void extend(AxisRange& range, std::span<const double> values) {
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    range.min = std::min(range.min, v);
    range.max = std::max(range.max, v);
  }
}

AxisRange rounded(const AxisRange& data, const PlotAxis& axis) {
  double low = data.min;
  double high = data.max;
  if (std::isfinite(axis.min)) low = axis.min;
  if (std::isfinite(axis.max)) high = axis.max;
  if (!(low <= high)) return {0, 1};
  // A constant gets some room; the magnitude matters, for 1e9 + 1 may be 1e9 in doubles.
  if (high - low <= 1e-9 * std::max(std::abs(low), std::abs(high)) || high == low) {
    const double room = low == 0 ? 1 : 0.1 * std::abs(low);
    if (!std::isfinite(axis.max)) high = low + room;
    if (!std::isfinite(axis.min)) low -= room;
    if (!(low < high)) high = low + room;
  }
  // A hair below zero beside a large range is no reason for a step of axis below it.
  if (low < 0 && low > -0.01 * high && !std::isfinite(axis.min)) low = 0;
  const std::vector<double> ticks = nice_ticks(low, high, 7);
  const double step = ticks.size() > 1 ? tick_step(ticks) : 0;
  if (step > 0 && !std::isfinite(axis.min)) low = step * std::floor(low / step);
  if (step > 0 && !std::isfinite(axis.max)) high = step * std::ceil(high / step);
  return {low, high};
}

std::vector<double> nice_ticks(double min, double max, int max_count) {
  const double range = max - min;
  if (!(range > 0) || !std::isfinite(range) || max_count < 1) return {};
  double step = std::pow(10, std::floor(std::log10(range / max_count)));
  for (const double factor : {2.0, 2.5, 2.0, 2.0}) {  // 1, 2, 5, 10, 20
    if (std::floor(max / step + 1e-9) - std::ceil(min / step - 1e-9) + 1 <= max_count) break;
    step *= factor;
  }
  std::vector<double> ticks;
  const double first = std::ceil(min / step - 1e-9);
  for (double k = first; k <= max / step + 1e-9 && ticks.size() < static_cast<std::size_t>(max_count); ++k) {
    ticks.push_back(k * step);
  }
  return ticks;
}

double tick_step(std::span<const double> ticks) {
  return ticks.size() > 1 ? ticks[1] - ticks[0] : 1;
}

std::string tick_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  const double magnitude = std::max(std::abs(value), step);
  if (magnitude >= 1e6 || step < 1e-5) return fmt::format("{:.4g}", value);
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace stylet::figures
