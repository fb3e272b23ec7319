#include "engine/content/breathing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::content {
namespace {

constexpr double kDrawnIn = 0.3;    // s; a breath that is drawn once and held
constexpr double kShortest = 0.75;  // of a period: the fastest breath that is still taken between two holds

/// Time integral of a rate that rises linearly to 1 within `ramp` and, `length` after its start, has fallen to 0 in
/// the same way.
double trapezium(double t, double ramp, double length) {
  const double rise = std::clamp(t, 0.0, ramp);
  const double fall = std::clamp(t - (length - ramp), 0.0, ramp);
  const double full = std::clamp(t - ramp, 0.0, length - 2 * ramp);
  return rise * rise / (2 * ramp) + full + fall - fall * fall / (2 * ramp);
}

}  // namespace

double breaths(const Breathing& breathing, double time_s) {
  if (breathing.holds.empty()) return time_s / breathing.period;
  const double ramp = breathing.period / 4;
  double drawn = 0;  // whole breaths
  double start = 0;  // of breathing after a hold
  for (const auto& [from, to] : breathing.holds) {
    // A ramp at each end counts half.
    const double room = from - start - ramp;
    const double count = std::floor(room / breathing.period + 1 - kShortest);
    if (count >= 1) {
      if (time_s < from) return drawn + count / room * trapezium(time_s - start, ramp, from - start);
      drawn += count;
    }
    if (time_s < to) return drawn;
    start = to;
  }
  const double since = time_s - start;
  return drawn + (since < ramp ? since * since / (2 * ramp) : since - ramp / 2) / breathing.period;
}

double inspiration(const Breathing& breathing, double time_s) {
  if (breathing.drawn_once) {
    const double t = std::clamp(time_s / kDrawnIn, 0.0, 1.0);
    return breathing.amplitude * *breathing.drawn_once * t * t * (3 - 2 * t);
  }
  const double s = std::sin(std::numbers::pi * breaths(breathing, time_s));
  return breathing.amplitude * s * s * s * s;
}

}  // namespace stylet::content
