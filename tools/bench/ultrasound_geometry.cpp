// Where the scan-converted picture shows the wires.
#include "engine/picture/picture.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/reference/image_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kWindow = 0.004;  ///< half the edge of the square in which a wire is sought, m

/// Where the picture shows the wire near `place`, m. Grey levels are taken as decibels over the dynamic range.
Eigen::Vector2d shown_at(const Eigen::MatrixXd& grey, const PhantomScan& phantom, const Eigen::Vector2d& place) {
  const ultrasound::SectorGeometry& sector = phantom.sector();
  const Eigen::Vector2i low = sector.pixel(place.array() - kWindow).array().ceil().cast<int>().max(0);
  const Eigen::Vector2i high = sector.pixel(place.array() + kWindow)
                                   .array()
                                   .floor()
                                   .cast<int>()
                                   .min(Eigen::Array2i(sector.width - 1, sector.height - 1));
  const Eigen::MatrixXd level = grey.block(low.y(), low.x(), high.y() - low.y() + 1, high.x() - low.x() + 1);
  const double db_per_level = phantom.scene().probe.dynamic_range_db / 255;
  const Eigen::MatrixXd amplitude = (level.array() * (db_per_level * std::log(10.0) / 20)).exp();
  return sector.position(low.cast<double>() + reference::echo_centre(amplitude));
}

}  // namespace

Report geometry_quality(const QualityRun& run) {
  const std::vector<Eigen::Vector2d> places = reference::wire_places();
  std::vector<double> worst(places.size(), 0.0);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double brightest = 0;
  Report report;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    PhantomScan phantom(run.device, reference::wire_phantom(), raw_settings(seed, true));
    phantom.envelope();
    const Eigen::MatrixXd grey = phantom.grey();
    brightest = std::max(brightest, grey.maxCoeff());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector2d error = shown_at(grey, phantom, places[i]) - places[i];
      worst[i] = std::max(worst[i], error.norm());
      sum += error / static_cast<double>(places.size()) / run.seeds;
    }
    if (seed > 1 || run.out.empty()) continue;
    picture::write_png(run.out / "wires.png", phantom.picture());
    report.figures.push_back({"Wires",
                              "A column every 10 mm and a row at 90 mm every 20 mm, 30 dB over the background, gain "
                              "turned down by 10 dB. Preset raw.",
                              run.out / "wires.png"});
  }
  const char* conditions = "raw; noise -69 dB; in the picture: TGC and compression on";
  const std::size_t farthest = static_cast<std::size_t>(std::ranges::max_element(worst) - worst.begin());
  report.add(noted(at_most("geometry.wires.worst", 1e3 * worst[farthest], "mm", 0.5, 0.0),
                   fmt::format("{} wires, the worst at ({:.0f}, {:.0f}) mm; {}", places.size(),
                               1e3 * places[farthest].x(), 1e3 * places[farthest].y(), conditions)));
  report.add({"geometry.wires.mean_across", 1e3 * sum.x(), "mm", 0.0, {}, {}, conditions});
  report.add({"geometry.wires.mean_along", 1e3 * sum.y(), "mm", 0.0, {}, {}, conditions});
  report.add(noted(at_most("geometry.brightest", brightest, "level", 254), "nothing is clipped"));
  return report;
}

}  // namespace stylet::bench
