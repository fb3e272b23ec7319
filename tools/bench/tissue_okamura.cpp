// The insertion of Okamura, Simone and O'Leary (2004): an 18G needle at 3 mm/s into bovine liver.
#include "tools/bench/tissue_parts.h"
#include "tools/reference/liver_block.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kSpeed = 3e-3;  // m/s
// What is published of the curve: it leaves zero at about 9 mm of travel, rises convexly (a polynomial of second
// order) to 1.41 N at 19 mm, and falls to 0.15 N.
constexpr double kTouch = 9e-3;      // m
constexpr double kPuncture = 19e-3;  // m
constexpr double kPeak = 1.41;       // N
constexpr double kAfter = 0.15;      // N

reference::LiverBlockSettings block_settings(const BenchOptions& options) {
  reference::LiverBlockSettings settings;
  settings.gap = kTouch;
  if (options.quick) {
    settings.cells_across = 6;
    settings.cells_deep = 4;
  }
  return settings;
}

double published(double travel) {
  const double share = std::max(0.0, travel - kTouch) / (kPuncture - kTouch);
  return kPeak * share * share;
}

/// Pressed to a travel and held for 10 s, then taken back.
void held_and_unloaded(const reference::LiverBlockSettings& settings, Report& report) {
  constexpr double kHeld = 6e-3;  // m of indentation
  reference::LiverBlock held(settings);
  held.go(kSpeed, (kTouch + kHeld) / kSpeed);
  const double pressed = held.samples().back().force;
  held.go(0, 10);
  report.add(noted(within("okamura.relaxation", 100 * (1 - held.samples().back().force / pressed), "%", 30, 10),
                   "of the force after 10 s, stopped 6 mm into the face, not broken through"));

  reference::LiverBlock cycled(settings);
  cycled.go(kSpeed, (kTouch + kHeld) / kSpeed);
  const double taken = cycled.needle().hand_work;
  cycled.go(-kSpeed, (kTouch + kHeld) / kSpeed);
  report.add(noted(at_least("okamura.hysteresis", 100 * cycled.needle().hand_work / taken, "%", 5),
                   "of the work of pressing 6 mm that does not come back"));
  for (int cycle = 0; cycle < 2; ++cycle) {
    const double before = cycled.needle().hand_work;
    cycled.go(kSpeed, (kTouch + kHeld) / kSpeed);
    cycled.go(-kSpeed, (kTouch + kHeld) / kSpeed);
    report.add(at_least(fmt::format("okamura.cycle_{}.energy", cycle + 2), 1e3 * (cycled.needle().hand_work - before),
                        "mJ", 0));
  }
}

}  // namespace

Report tissue_okamura(const BenchOptions& options) {
  const reference::LiverBlockSettings settings = block_settings(options);
  reference::LiverBlock block(settings);
  block.go(kSpeed, 26e-3 / kSpeed);
  std::vector<double> depth;
  std::vector<double> force;
  double squares = 0;
  double after = kPeak;
  double deepest = 0;
  for (const reference::LiverBlock::Sample& sample : block.samples()) {
    if (sample.inside) {
      if (sample.travel < deepest + 1e-3) after = std::min(after, sample.force);
      continue;
    }
    deepest = sample.travel;
    if (sample.travel < kTouch) continue;
    depth.push_back(sample.travel - kTouch);
    force.push_back(sample.force);
    squares += std::pow(sample.force - published(sample.travel), 2);
  }
  Report report;
  const std::string where = fmt::format(
      "block {:.0f} x {:.0f} x {:.0f} mm, back glued to a board; 18G of its own radius; E {:.0f} kPa, b {:.0f}, "
      "capsule {:.0f} N/m",
      1e3 * settings.side, 1e3 * settings.side, 1e3 * settings.depth, 1e-3 * settings.material.young_modulus,
      settings.material.stiffening, settings.capsule);
  report.add(noted(within("okamura.puncture.travel", 1e3 * deepest, "mm", 1e3 * kPuncture, 2), where));
  report.add(
      noted(within("okamura.puncture.force", force.back(), "N", kPeak, 0.1), "the force given to break it is this"));
  report.add(noted(within("okamura.after", after, "N", kAfter, 0.05), "least within a millimeter after it"));
  report.add(noted(at_most("okamura.rmse", std::sqrt(squares / static_cast<double>(depth.size())), "N", 0.15),
                   "before puncture, against 1.41 N ((x - 9 mm)/10 mm)^2"));
  report.add(within("okamura.exponent", reference::force_exponent(depth, force), "1", 1.95, 0.25));
  const double inside = block.needle().tip_depth;
  report.add(noted(within("okamura.at_26_mm", block.samples().back().force, "N",
                          settings.resistance.cutting_force + settings.resistance.friction_per_length * inside, 0.1),
                   fmt::format("cutting 0.15 N and friction 18 N/m of {:.1f} mm inside", 1e3 * inside)));
  held_and_unloaded(settings, report);
  return report;
}

}  // namespace stylet::bench
