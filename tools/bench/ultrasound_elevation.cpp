// Speckle that leaves the image plane: correlation over motion across it, against the slice thickness.
#include "engine/ultrasound/beam_profile.h"
#include "tools/bench/coupling_parts.h"
#include "tools/bench/figure_files.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/reference/image_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kElevationDepth = 0.070;  ///< the elevation focus, m
constexpr std::array kOtherDepths{0.040, 0.110};

const std::vector<double>& elevations() {
  static const std::vector<double> all{0, 0.25e-3, 0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3};
  return all;
}

/// Correlation of the intensities of two images around `depth` (m), depth trend removed.
double intensity_correlation(const PhantomScan& phantom, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                             double depth) {
  const auto band = [&](const Eigen::MatrixXd& envelope) -> Eigen::MatrixXd {
    const int first = phantom.sample_at(depth - 0.015), last = phantom.sample_at(depth + 0.015);
    return reference::without_depth_trend(envelope.middleRows(first, last - first + 1)).cwiseAbs2();
  };
  return reference::correlation(band(a), band(b));
}

/// Two Gaussian slices at a distance, sensitivity of `depth`.
double elevation_theory(double distance, double depth) {
  const double s = ultrasound::elevation_fwhm(content::Probe{}, depth) / std::sqrt(8 * std::numbers::ln2);
  return std::exp(-0.5 * distance * distance / (s * s));
}

struct Elevation {
  std::vector<double> correlation;  ///< by elevations(), mean over seeds
  double worst(double depth) const {
    double error = 0;
    for (std::size_t i = 0; i < correlation.size(); ++i) {
      error = std::max(error, std::abs(correlation[i] - elevation_theory(elevations()[i], depth)));
    }
    return error;
  }
};

void add_elevation(PhantomScan& phantom, const Eigen::MatrixXd& still, double share,
                   std::vector<Elevation>& by_depth) {
  by_depth.resize(1 + kOtherDepths.size());
  for (Elevation& e : by_depth) e.correlation.resize(elevations().size(), 0.0);
  for (std::size_t i = 0; i < elevations().size(); ++i) {
    const auto across = static_cast<float>(elevations()[i]);
    const Eigen::MatrixXd now = phantom.envelope(phantom.moved(
        [&](const Eigen::Vector3f& p) -> Eigen::Vector3f { return p + Eigen::Vector3f(0, across, 0); }));
    by_depth[0].correlation[i] += share * intensity_correlation(phantom, still, now, kElevationDepth);
    for (std::size_t k = 0; k < kOtherDepths.size(); ++k) {
      by_depth[k + 1].correlation[i] += share * intensity_correlation(phantom, still, now, kOtherDepths[k]);
    }
  }
}

void add_elevation_rows(Report& report, int planes, double bound, const std::vector<Elevation>& by_depth) {
  for (std::size_t i = 0; i < elevations().size(); ++i) {
    report.add(
        noted(within(fmt::format("elevation.{}_planes.{:.2f}mm", planes, 1e3 * elevations()[i]),
                     by_depth[0].correlation[i], "1", elevation_theory(elevations()[i], kElevationDepth), bound),
              kWithoutNoise));
  }
  for (std::size_t k = 0; k < kOtherDepths.size(); ++k) {
    report.add(noted(within(fmt::format("elevation.{}_planes.worst_at_{:.0f}mm", planes, 1e3 * kOtherDepths[k]),
                            by_depth[k + 1].worst(kOtherDepths[k]), "1", 0.0, bound),
                     "largest distance from theory, away from the elevation focus"));
  }
}

}  // namespace

Report elevation_quality(const QualityRun& run) {
  std::vector<Elevation> nine, thirteen;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    for (const auto& [planes, result] : {std::pair{9, &nine}, std::pair{13, &thirteen}}) {
      ultrasound::ImagerSettings settings = raw_settings(seed, false);
      settings.planes = planes;
      PhantomScan phantom(run.device, reference::uniform_phantom(), settings);
      add_elevation(phantom, phantom.envelope(), 1.0 / run.seeds, *result);
    }
  }
  Report report;
  add_elevation_rows(report, 9, 0.12, nine);
  add_elevation_rows(report, 13, 0.10, thirteen);
  if (run.out.empty()) return report;

  std::vector<double> x, theory;
  for (const double d : elevations()) {
    x.push_back(1e3 * d);
    theory.push_back(elevation_theory(d, kElevationDepth));
  }
  const figures::PlotPanel panel{
      .title = "Correlation with the image before, tissue moved across the image plane",
      .x = {.label = "distance, mm"},
      .y = {.label = "correlation of intensity", .min = 0, .max = 1},
      .series = {plot_line("Gaussian slice", x, theory, 1), plot_line("9 planes", x, nine[0].correlation, 0),
                 plot_line("13 planes", x, thirteen[0].correlation, 2)}};
  const std::string caption =
      fmt::format("At {:.0f} mm, mean of {} seeds; preset raw, noise off.", 1e3 * kElevationDepth, run.seeds);
  const std::array columns{FigureColumn{"distance_mm", x}, FigureColumn{"theory", theory},
                           FigureColumn{"planes_9", nine[0].correlation},
                           FigureColumn{"planes_13", thirteen[0].correlation}};
  write_figure(run.out, "elevation", std::span(&panel, 1), std::span(&caption, 1), columns);
  report.figures.push_back({"Elevational decorrelation", caption, run.out / "elevation.png"});
  return report;
}

}  // namespace stylet::bench
