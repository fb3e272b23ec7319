// The needle by insertion angle, and whether an image comes out the same twice.
#include "engine/picture/picture.h"
#include "tools/bench/coupling_parts.h"
#include "tools/bench/figure_files.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/reference/image_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kShaftDepth = 0.060;      ///< of the piece of shaft that is measured, m
constexpr double kHalfLength = 0.012;      ///< of that piece, m
constexpr double kHalfWidth = 0.0005;      ///< of the band along its echo, m
constexpr int kStep = 10, kSteepest = 70;  ///< degrees from the face of the probe

/// The needle at an angle to the face of the probe, through the middle of the image; its tip is out of the way.
Eigen::Vector2d shaft_direction(int degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {std::cos(angle), std::sin(angle)};
}

state::FrameState with_needle(const PhantomScan& phantom, int degrees) {
  state::FrameState state = phantom.rest();
  const Eigen::Vector2d d = shaft_direction(degrees);
  const auto point = [&](double along) {
    return Eigen::Vector3d(along * d.x(), 0, kShaftDepth + along * d.y()).cast<float>().eval();
  };
  reference::place_needle(state, point(-0.050), point(0.040));
  return state;
}

/// Power of the band along the echo of the shaft, which comes from its near side, with the needle over without.
double shaft_contrast(PhantomScan& phantom, const Eigen::MatrixXd& plain, int degrees) {
  const Eigen::MatrixXd image = phantom.envelope(with_needle(phantom, degrees));
  const Eigen::Vector2d d = shaft_direction(degrees);
  const double radius = 0.5 * phantom.scene().needle.outer_diameter;
  const auto on_shaft = [&](double x, double z) {
    const Eigen::Vector2d from_middle(x, z - kShaftDepth + radius);
    return std::abs(from_middle.dot(d)) < kHalfLength &&
           std::abs(from_middle.x() * d.y() - from_middle.y() * d.x()) < kHalfWidth;
  };
  return reference::contrast_db(amplitudes(image, phantom.scan(), on_shaft),
                                amplitudes(plain, phantom.scan(), on_shaft));
}

/// Samples and pixels that differ between images of one state: of one imager, with another image between, and of a
/// second one.
int differences(const QualityRun& run) {
  PhantomScan first(run.device, reference::whole_phantom(), raw_settings(1, true));
  const state::FrameState state = with_needle(first, 30);
  const Eigen::MatrixXd envelope = first.envelope(state), grey = first.grey();
  first.envelope();
  const auto count = [&](PhantomScan& phantom) {
    const Eigen::MatrixXd again = phantom.envelope(state);
    return static_cast<int>((again.array() != envelope.array()).count() +
                            (phantom.grey().array() != grey.array()).count());
  };
  PhantomScan second(run.device, reference::whole_phantom(), raw_settings(1, true));
  return count(first) + count(second);
}

}  // namespace

Report needle_quality(const QualityRun& run) {
  std::vector<double> degrees, contrast;
  for (int angle = 0; angle <= kSteepest; angle += kStep) degrees.push_back(angle);
  contrast.resize(degrees.size(), 0.0);
  Report report;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    PhantomScan phantom(run.device, reference::uniform_phantom(), raw_settings(seed, true));
    const Eigen::MatrixXd plain = phantom.envelope();
    for (std::size_t i = 0; i < degrees.size(); ++i) {
      contrast[i] += shaft_contrast(phantom, plain, static_cast<int>(degrees[i])) / run.seeds;
      if (seed > 1 || run.out.empty() || (degrees[i] != 20 && degrees[i] != 60)) continue;
      const std::string name = fmt::format("needle_{:.0f}_degrees", degrees[i]);
      picture::write_png(run.out / (name + ".png"), phantom.picture());
      report.figures.push_back({fmt::format("Needle at {:.0f} degrees", degrees[i]),
                                "To the face of the probe, in the homogeneous phantom. Preset raw.",
                                run.out / (name + ".png")});
    }
  }
  double rise = -std::numeric_limits<double>::infinity();
  double least_flat = std::numeric_limits<double>::infinity(), most_steep = -least_flat;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    report.add(
        {fmt::format("needle.contrast.{:.0f}_degrees", degrees[i]), contrast[i], "dB", {}, {}, {}, kWithNoise});
    if (i > 0) rise = std::max(rise, contrast[i] - contrast[i - 1]);
    if (degrees[i] <= 20) least_flat = std::min(least_flat, contrast[i]);
    if (degrees[i] >= 60) most_steep = std::max(most_steep, contrast[i]);
  }
  report.add(
      noted(at_most("needle.contrast.largest_rise", rise, "dB", 0), "from one angle to the next: falls throughout"));
  report.add(noted(at_least("needle.contrast.up_to_20_degrees", least_flat, "dB", 15), kWithNoise));
  report.add(noted(at_most("needle.contrast.from_60_degrees", most_steep, "dB", 5), kWithNoise));
  Measurement repeat{"repeat.differing_samples",
                     static_cast<double>(differences(run)),
                     "1",
                     0.0,
                     {},
                     {},
                     "envelope and picture, again and by a second imager"};
  if (run.device.identity().is_lavapipe())
    repeat = noted(at_most(repeat.name, repeat.value, "1", 0, 0.0), repeat.note);
  report.add(repeat);
  if (run.out.empty()) return report;

  const figures::PlotPanel panel{.title = "Needle over background",
                                 .x = {.label = "angle between needle and face of the probe, degrees"},
                                 .y = {.label = "contrast, dB"},
                                 .series = {plot_line("shaft", degrees, contrast, 0)}};
  const std::string caption =
      fmt::format("Band of 1 mm along 24 mm of shaft at {:.0f} mm, with the needle over without; mean of {} seeds.",
                  1e3 * kShaftDepth, run.seeds);
  const std::array columns{FigureColumn{"angle_degrees", degrees}, FigureColumn{"contrast_db", contrast}};
  write_figure(run.out, "needle", std::span(&panel, 1), std::span(&caption, 1), columns);
  report.figures.push_back({"Needle by insertion angle", caption, run.out / "needle.png"});
  return report;
}

}  // namespace stylet::bench
