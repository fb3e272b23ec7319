// Targets of known contrast, the shadow of a rib and what lies behind fluid.
#include "engine/picture/picture.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/reference/image_metrics.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kTargetMargin = 0.0010;  ///< of a target's rim that is left out: the beam is as wide, m

/// Means and worst over seeds.
struct PerSeed {
  std::vector<double> values;

  double mean() const { return reference::moments(values).mean; }
  double deviation() const { return reference::moments(values).deviation; }
};

struct TargetResult {
  PerSeed contrast_db, generalised;
};

/// A cylinder against the background at its depth, right and left of it.
/// @param reach  of the background from the middle: half way to the next target, m
void add_target(const PhantomScan& phantom, const Eigen::MatrixXd& envelope, const reference::Cylinder& target,
                double margin, double reach, TargetResult& result) {
  const std::vector<double> inside =
      amplitudes(envelope, phantom.scan(), [&](double x, double z) { return target.holds(x, z, margin); });
  const std::vector<double> outside = amplitudes(envelope, phantom.scan(), [&](double x, double z) {
    const double away = std::abs(x - target.x);
    return std::abs(z - target.z) < target.radius - margin && away > target.radius + 0.0015 && away < reach;
  });
  result.contrast_db.values.push_back(reference::contrast_db(inside, outside));
  result.generalised.values.push_back(reference::generalised_contrast(inside, outside));
}

/// Lines and ranges (m) behind a cylinder as the beam sees it: within `half_width` of the line through its middle.
struct Behind {
  const PhantomScan& phantom;
  reference::Cylinder cylinder;
  double half_width, from, to;  ///< from and to: ranges beyond the cylinder's middle

  Eigen::Vector2d middle() const { return phantom.scan().line_and_sample({cylinder.x, cylinder.z}); }
  double range() const { return phantom.scan().range(middle().y()); }
  /// Mean of value(line) over the lines.
  template <typename Value>
  double mean_over_lines(Value&& value) const {
    const double lines = half_width / phantom.scan().lateral_pitch(range());
    double sum = 0;
    int count = 0;
    for (int l = static_cast<int>(std::ceil(middle().x() - lines)); l <= middle().x() + lines; ++l) {
      sum += value(l);
      ++count;
    }
    return sum / count;
  }
  double power(const Eigen::MatrixXd& envelope) const {
    const int first = phantom.sample_at(range() + from), last = phantom.sample_at(range() + to);
    return mean_over_lines(
        [&](int l) { return envelope.col(l).segment(first, last - first + 1).squaredNorm() / (last - first + 1); });
  }
  /// Path through the cylinder, mean over its lines, m.
  double path() const {
    return mean_over_lines([&](int l) {
      const double off = (l - middle().x()) * phantom.scan().lateral_pitch(range());
      return 2 * std::sqrt(cylinder.radius * cylinder.radius - off * off);
    });
  }
};

std::string signed_db(double db) {
  return fmt::format("{}{:.0f}_db", db < 0 ? "minus_" : "plus_", std::abs(db));
}

void write_picture(const QualityRun& run, PhantomScan& phantom, const std::string& name, const std::string& title,
                   const std::string& caption, Report& report) {
  const std::filesystem::path file = run.out / (name + ".png");
  picture::write_png(file, phantom.picture());
  report.figures.push_back({title, caption, file});
}

}  // namespace

Report contrast_quality(const QualityRun& run) {
  std::vector<TargetResult> grey(reference::grey_targets().size()), steps(reference::stepped_cylinders().size());
  PerSeed shadow, rib_surface, enhancement;
  double enhancement_theory = 0;
  Report report;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    PhantomScan targets(run.device, reference::target_phantom(), raw_settings(seed, true));
    const Eigen::MatrixXd envelope = targets.envelope();
    for (std::size_t i = 0; i < grey.size(); ++i) {
      add_target(targets, envelope, reference::grey_targets()[i].where, kTargetMargin, 0.0125, grey[i]);
    }
    for (std::size_t i = 0; i < steps.size(); ++i) {
      add_target(targets, envelope, reference::stepped_cylinders()[i], 0.5 * reference::stepped_cylinders()[i].radius,
                 0.0090, steps[i]);
    }
    PhantomScan obstacles(run.device, reference::obstacle_phantom(), raw_settings(seed, true));
    PhantomScan plain(run.device, reference::uniform_phantom(), raw_settings(seed, true));
    const Eigen::MatrixXd hindered = obstacles.envelope(), free = plain.envelope();
    // The speckle behind is the same in both, so it cancels.
    const Behind rib{obstacles, reference::kRib, 0.5 * reference::kRib.radius, 0.015, 0.090};
    shadow.values.push_back(reference::decibels(rib.power(hindered) / rib.power(free)));
    const Behind surface{obstacles, reference::kRib, 0.3 * reference::kRib.radius, -reference::kRib.radius - 0.001,
                         -reference::kRib.radius + 0.001};
    rib_surface.values.push_back(reference::decibels(surface.power(hindered) / surface.power(free)));
    const Behind fluid{obstacles, reference::kFluidCylinder, 0.003, reference::kFluidCylinder.radius + 0.005, 0.050};
    enhancement.values.push_back(reference::decibels(fluid.power(hindered) / fluid.power(free)));
    enhancement_theory = 2 * (reference::kBackgroundAttenuation - reference::kFluidAttenuation) * 1e-6 *
                         obstacles.scene().probe.frequency_hz * 100 * fluid.path();
    if (seed > 1 || run.out.empty()) continue;
    write_picture(run, targets, "targets", "Grey-scale targets and stepped cylinders",
                  "At 70 mm: anechoic, 8 mm wide; -6, -3, +3, +6 dB, 12 mm wide. At 40 mm: anechoic, the area of "
                  "each 1.5 times "
                  "that of the one before, 3 mm first; 10 mm wide at 120 mm. Preset raw.",
                  report);
    write_picture(run, obstacles, "obstacles", "Rib and fluid cylinder",
                  "Shadow behind the rib, enhancement behind the fluid. Preset raw.", report);
  }
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const double set = reference::grey_targets()[i].contrast_db;
    const double measured = grey[i].contrast_db.mean();
    if (set == reference::kAnechoicDb) {
      report.add(noted(at_most("contrast.anechoic", measured, "dB", -25), kWithNoise));
      report.add(noted(at_least("contrast.anechoic.gcnr", grey[i].generalised.mean(), "1", 0.95, 1.0), kWithNoise));
      continue;
    }
    report.add(noted(within("contrast." + signed_db(set), measured, "dB", set, 1.5), kWithNoise));
    report.add({"contrast." + signed_db(set) + ".spread",
                grey[i].contrast_db.deviation(),
                "dB",
                {},
                {},
                {},
                "standard deviation over seeds"});
  }
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const reference::Cylinder& c = reference::stepped_cylinders()[i];
    report.add({fmt::format("contrast.cylinder.{:.1f}mm_at_{:.0f}mm.gcnr", 2e3 * c.radius, 1e3 * c.z),
                steps[i].generalised.mean(),
                "1",
                1.0,
                {},
                {},
                kWithNoise});
  }
  report.add(noted(at_most("shadow.rib", shadow.mean(), "dB", -30), kWithNoise));
  report.add(noted(at_least("shadow.rib.surface", rib_surface.mean(), "dB", 10), "bright over the background"));
  report.add(noted(within("enhancement.fluid", enhancement.mean(), "dB", enhancement_theory, 1), kWithNoise));
  return report;
}

}  // namespace stylet::bench
