// Speckle and attenuation in the homogeneous phantom.
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
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kFirstRange = 0.020, kLastRange = 0.150;  ///< of the statistics, m
constexpr std::array kWidthRanges{0.040, 0.070, 0.100, 0.130};
constexpr double kWidthBand = 0.010;  ///< half the depth over which a width is averaged, m
constexpr int kEdgeLines = 8;         ///< at either side, where the beam's kernel leaves the sector

double mean(const std::vector<double>& values) {
  return reference::moments(values).mean;
}

struct SpeckleSamples {
  std::vector<double> signal_to_noise, log_deviation_db, nakagami_m;    ///< [seed]
  std::vector<double> independent;                                      ///< of all seeds, over their mean
  std::array<std::vector<double>, kWidthRanges.size()> axial, lateral;  ///< [range][seed], m
};

/// Samples of `flat` (first row: `first`) two beam widths apart.
void add_independent(const PhantomScan& phantom, const Eigen::MatrixXd& flat, int first,
                     std::vector<double>& independent) {
  double row = 0;
  while (row < static_cast<double>(flat.rows())) {
    const double range = phantom.scan().range(first + row);
    const double step =
        2 * ultrasound::lateral_fwhm(range, phantom.wavelength()) / phantom.scan().lateral_pitch(range);
    for (double column = 0; column < static_cast<double>(flat.cols()); column += std::ceil(step)) {
      independent.push_back(flat(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)));
    }
    row += std::ceil(2 * ultrasound::axial_fwhm(range) / phantom.scan().sample_pitch);
  }
}

void add_speckle(const PhantomScan& phantom, const Eigen::MatrixXd& envelope, SpeckleSamples& samples) {
  const auto band = [&](double from, double to) {
    const int first = phantom.sample_at(from);
    return reference::without_depth_trend(
        envelope.block(first, kEdgeLines, phantom.sample_at(to) - first + 1, phantom.scan().lines - 2 * kEdgeLines));
  };
  const Eigen::MatrixXd flat = band(kFirstRange, kLastRange);
  const reference::SpeckleStatistics s =
      reference::speckle_statistics({flat.data(), static_cast<std::size_t>(flat.size())});
  samples.signal_to_noise.push_back(s.signal_to_noise);
  samples.log_deviation_db.push_back(s.log_deviation_db);
  samples.nakagami_m.push_back(s.nakagami_m);
  add_independent(phantom, flat, phantom.sample_at(kFirstRange), samples.independent);
  for (std::size_t i = 0; i < kWidthRanges.size(); ++i) {
    const Eigen::MatrixXd intensity = band(kWidthRanges[i] - kWidthBand, kWidthRanges[i] + kWidthBand).cwiseAbs2();
    samples.axial[i].push_back(reference::speckle_width(intensity, reference::Axis::axial) *
                               phantom.scan().sample_pitch);
    samples.lateral[i].push_back(reference::speckle_width(intensity, reference::Axis::lateral) *
                                 phantom.scan().lateral_pitch(kWidthRanges[i]));
  }
}

Report speckle_rows(const SpeckleSamples& samples, double wavelength) {
  Report report;
  report.add(noted(within("speckle.signal_to_noise", mean(samples.signal_to_noise), "1", 1.91, 0.05), kWithoutNoise));
  report.add({"speckle.signal_to_noise.spread",
              reference::moments(samples.signal_to_noise).deviation,
              "1",
              {},
              {},
              {},
              "standard deviation over seeds"});
  report.add(noted(within("speckle.log_deviation", mean(samples.log_deviation_db), "dB", 5.57, 0.4), kWithoutNoise));
  report.add(noted(within("speckle.nakagami_m", mean(samples.nakagami_m), "1", 1, 0.1), kWithoutNoise));
  report.add(
      noted(at_most("speckle.rayleigh_distance", reference::rayleigh_distance(samples.independent), "1",
                    reference::kRayleighDistanceOfOnePercent),
            fmt::format("Kolmogorov-Smirnov after Stephens, bound: 1 % level; {} samples two beam widths apart",
                        samples.independent.size())));
  for (std::size_t i = 0; i < kWidthRanges.size(); ++i) {
    const double range = kWidthRanges[i];
    const auto add = [&](const char* name, const std::vector<double>& widths, double set) {
      report.add(noted(within(fmt::format("speckle.{}.{:.0f}mm", name, 1e3 * range), 1e3 * mean(widths), "mm",
                              1e3 * set, 0.15 * 1e3 * set),
                       kWithoutNoise));
    };
    add("axial", samples.axial[i], ultrasound::axial_fwhm(range));
    add("lateral", samples.lateral[i], ultrasound::lateral_fwhm(range, wavelength));
  }
  return report;
}

/// Mean power by depth over lines and seeds.
struct DepthProfile {
  std::vector<double> power;  ///< [sample]

  void add(const Eigen::MatrixXd& envelope, int first_line, int lines) {
    const Eigen::VectorXd rows = envelope.middleCols(first_line, lines).cwiseAbs2().rowwise().mean();
    power.resize(rows.size(), 0.0);
    for (std::size_t s = 0; s < power.size(); ++s) power[s] += rows[static_cast<Eigen::Index>(s)];
  }
};

struct Slope {
  double attenuation = 0;  ///< dB/cm/MHz
  double level_db = 0;     ///< power at the face
  std::vector<double> depth_cm, power_db, fit_db;
};
Slope attenuation_slope(const PhantomScan& phantom, const DepthProfile& profile, int seeds) {
  Slope slope;
  for (int s = phantom.sample_at(0.015); s <= phantom.sample_at(0.145); ++s) {
    slope.depth_cm.push_back(100 * phantom.scan().range(s));
    slope.power_db.push_back(reference::decibels(profile.power[s] / seeds));
  }
  const reference::Line line = reference::fit_line(slope.depth_cm, slope.power_db);
  slope.attenuation = -line.slope / (2 * 1e-6 * phantom.scene().probe.frequency_hz);
  slope.level_db = line.level;
  for (const double depth : slope.depth_cm) slope.fit_db.push_back(line.level + line.slope * depth);
  return slope;
}

void write_figures(const QualityRun& run, const SpeckleSamples& samples, const Slope& soft, const Slope& dense,
                   Report& report) {
  std::vector<double> x, density, law;
  constexpr int kBins = 60;
  constexpr double kEnd = 4;
  std::vector<double> counts(kBins, 0.0);
  for (const double v : samples.independent)
    counts[std::min<std::size_t>(kBins - 1, static_cast<std::size_t>(kBins * v / kEnd))] += 1;
  for (int i = 0; i < kBins; ++i) {
    const double a = (i + 0.5) * kEnd / kBins;
    x.push_back(a);
    density.push_back(counts[i] * kBins / kEnd / static_cast<double>(samples.independent.size()));
    law.push_back(0.5 * std::numbers::pi * a * std::exp(-0.25 * std::numbers::pi * a * a));  // of mean 1
  }
  const figures::PlotPanel speckle{
      .title = "Speckle amplitude",
      .x = {.label = "amplitude over its mean"},
      .y = {.label = "density"},
      .series = {plot_line("measured", x, density, 0), plot_line("Rayleigh", x, law, 1)}};
  const figures::PlotPanel fall{.title = "Attenuation",
                                .x = {.label = "depth, cm"},
                                .y = {.label = "mean power, dB"},
                                .series = {plot_line("0.5 dB/cm/MHz", soft.depth_cm, soft.power_db, 0),
                                           plot_line("fit", soft.depth_cm, soft.fit_db, 1),
                                           plot_line("0.7 dB/cm/MHz", dense.depth_cm, dense.power_db, 2),
                                           plot_line("fit", dense.depth_cm, dense.fit_db, 3)}};
  const std::array panels{speckle, fall};
  const std::string caption = "Homogeneous phantom, preset raw, all seeds; noise off, before the depth gain.";
  const std::array columns{FigureColumn{"amplitude", x},
                           FigureColumn{"density", density},
                           FigureColumn{"rayleigh", law},
                           FigureColumn{"depth_cm", soft.depth_cm},
                           FigureColumn{"power_05_db", soft.power_db},
                           FigureColumn{"power_07_db", dense.power_db}};
  write_figure(run.out, "speckle", panels, std::span(&caption, 1), columns);
  report.figures.push_back({"Speckle and attenuation", caption, run.out / "speckle.png"});
}

}  // namespace

Report speckle_quality(const QualityRun& run) {
  SpeckleSamples samples;
  DepthProfile soft, dense;
  std::vector<double> compounded;
  double wavelength = 0;
  Slope soft_slope, dense_slope;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    PhantomScan uniform(run.device, reference::uniform_phantom(), raw_settings(seed, false));
    add_speckle(uniform, uniform.envelope(), samples);
    wavelength = uniform.wavelength();

    ultrasound::ImagerSettings three_looks = raw_settings(seed, false);
    three_looks.looks = ultrasound::kMaxLooks;
    PhantomScan looks(run.device, reference::uniform_phantom(), three_looks);
    SpeckleSamples of_looks;
    add_speckle(looks, looks.envelope(), of_looks);
    compounded.push_back(of_looks.signal_to_noise.front());

    PhantomScan zones(run.device, reference::zone_phantom(), raw_settings(seed, false));
    const Eigen::MatrixXd envelope = zones.envelope();
    const int half = zones.scan().lines / 2;
    soft.add(envelope, kEdgeLines, half - 2 * kEdgeLines);
    dense.add(envelope, half + kEdgeLines, half - 2 * kEdgeLines);
    if (seed < run.seeds) continue;
    soft_slope = attenuation_slope(zones, soft, run.seeds);
    dense_slope = attenuation_slope(zones, dense, run.seeds);
  }
  Report report = speckle_rows(samples, wavelength);
  const double gain = mean(compounded) / mean(samples.signal_to_noise);
  const double looks = ultrasound::kMaxLooks;
  report.add(
      noted(within("speckle.gain_of_3_looks", gain, "1", std::sqrt(looks), 0.08 * std::sqrt(looks)), kWithoutNoise));
  report.add(noted(within("attenuation.soft_zone", soft_slope.attenuation, "dB/cm/MHz",
                          reference::kBackgroundAttenuation, 0.05 * reference::kBackgroundAttenuation),
                   kWithoutNoise));
  report.add(noted(within("attenuation.dense_zone", dense_slope.attenuation, "dB/cm/MHz",
                          reference::kDenseAttenuation, 0.05 * reference::kDenseAttenuation),
                   kWithoutNoise));
  report.add(
      noted(within("attenuation.level_at_the_face", soft_slope.level_db, "dB", 0, 1), "over the rms of liver"));
  if (!run.out.empty()) write_figures(run, samples, soft_slope, dense_slope, report);
  return report;
}

}  // namespace stylet::bench
