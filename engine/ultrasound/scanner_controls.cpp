#include "engine/ultrasound/scanner_controls.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace stylet::ultrasound {

ScannerControls ScannerControls::of(const content::Probe& probe, double persistence) {
  return {.depth = probe.depth,
          .gain_db = probe.gain_db,
          .frequency_hz = probe.frequency_hz,
          .focus = probe.focus,
          .dynamic_range_db = probe.dynamic_range_db,
          .persistence = persistence,
          .tgc_db = probe.tgc_db};
}

ControlLimits ControlLimits::of(const content::Probe& probe) {
  return {.depth = {std::min(0.03, probe.depth), std::max(0.30, probe.depth)},
          .gain_db = {-60, 60},
          .frequency_hz = {std::min(probe.lowest_frequency_hz, probe.frequency_hz),
                           std::max(probe.highest_frequency_hz, probe.frequency_hz)},
          .focus = {std::min(0.01, probe.focus), std::max(0.20, probe.focus)},
          .dynamic_range_db = {20, 120},
          .persistence = {0, kMostPersistence},
          .tgc_db = {-20, 20}};
}

std::string limit(ScannerControls& controls, const content::Probe& probe) {
  const ControlLimits limits = ControlLimits::of(probe);
  const ScannerControls own = ScannerControls::of(probe, 0);
  std::vector<std::string> said;
  const auto check = [&said](double& value, double fallback, const ControlLimits::Range& range,
                             const std::string& name, double unit, const char* unit_name) {
    const double wanted = value;
    value = std::clamp(std::isfinite(wanted) ? wanted : fallback, range.min, range.max);
    if (value != wanted) said.push_back(fmt::format("{} limited to {:g}{}", name, value / unit, unit_name));
  };
  check(controls.depth, own.depth, limits.depth, "depth", 1e-3, " mm");
  check(controls.gain_db, own.gain_db, limits.gain_db, "gain", 1, " dB");
  check(controls.frequency_hz, own.frequency_hz, limits.frequency_hz, "frequency", 1e6, " MHz");
  check(controls.focus, own.focus, limits.focus, "focus", 1e-3, " mm");
  check(controls.dynamic_range_db, own.dynamic_range_db, limits.dynamic_range_db, "dynamic range", 1, " dB");
  check(controls.persistence, own.persistence, limits.persistence, "persistence", 1, "");
  for (std::size_t i = 0; i < controls.tgc_db.size(); ++i) {
    check(controls.tgc_db[i], own.tgc_db[i], limits.tgc_db, fmt::format("TGC {}", i + 1), 1, " dB");
  }
  return fmt::format("{}", fmt::join(said, ", "));
}

double slider_gain_db(const ScannerControls& controls, double share) {
  const double at = std::clamp(share * kTgcSliders - 0.5, 0.0, kTgcSliders - 1.0);
  const auto below = static_cast<std::size_t>(std::min(at, kTgcSliders - 2.0));
  return controls.tgc_db[below] +
         (at - static_cast<double>(below)) * (controls.tgc_db[below + 1] - controls.tgc_db[below]);
}

}  // namespace stylet::ultrasound
