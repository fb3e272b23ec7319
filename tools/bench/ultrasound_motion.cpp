// Speckle that goes with the tissue: rigid motion and strain, followed in the scan-converted envelope.
#include "engine/ultrasound/beam_profile.h"
#include "tools/bench/ultrasound_quality.h"
#include "tools/bench/ultrasound_scan.h"
#include "tools/reference/image_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kTrackedDepth = 0.070;                    ///< of the middle of what is followed, m
constexpr double kReach = 0.0025;                          ///< of the search, m
constexpr double kPixel = 0.0002;                          ///< of the scan-converted image, m
constexpr double kRigidHalf = 0.008, kStrainHalf = 0.004;  ///< half edges of the windows, m
constexpr std::array kStrains{0.03, 0.10};

const std::vector<Eigen::Vector2d>& shifts() {
  static const std::vector<Eigen::Vector2d> all{{0, 2e-3}, {2e-3, 0}, {-1.1e-3, 1.7e-3}, {0, 0.37e-3}};
  return all;
}

/// The square of edge 2 `half` (m) in the middle of the image at kTrackedDepth, followed from `still` to `now` in the
/// scan-converted image. -> shift in m
reference::Match follow(const PhantomScan& phantom, const Eigen::MatrixXd& still, const Eigen::MatrixXd& now,
                        double half) {
  const auto converted = [&](const Eigen::MatrixXd& envelope) {
    return scan_converted(envelope, phantom.scan(), {0, kTrackedDepth}, half + kReach + 5 * kPixel, kPixel);
  };
  const Eigen::MatrixXd first = converted(still);
  const int middle = static_cast<int>(first.rows() / 2), window = static_cast<int>(std::lround(half / kPixel));
  reference::Match match = reference::track(first, converted(now), {middle, middle}, {window, window},
                                            static_cast<int>(std::lround(kReach / kPixel)));
  match.shift *= kPixel;
  return match;
}

/// Mean over a window of half height `half` (m) of the correlation that two Gaussian pulses have whose distance grows
/// with the distance from its middle.
double strain_theory(double strain, double half) {
  const double width = ultrasound::axial_fwhm(kTrackedDepth);
  double sum = 0;
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i) {
    const double apart = strain * half * (i + 0.5) / kSteps / width;
    sum += std::exp(-4 * std::numbers::ln2 * apart * apart) / kSteps;
  }
  return sum;
}

struct Tracking {
  double worst_error = 0;  ///< samples along or lines across
  double least_ncc = 1;
  std::array<std::vector<double>, kStrains.size()> strained;  ///< correlation [strain][seed]

  void add(PhantomScan& phantom) {
    const Eigen::MatrixXd still = phantom.envelope();
    const Eigen::Vector2d pitch(phantom.scan().lateral_pitch(kTrackedDepth), phantom.scan().sample_pitch);
    for (const Eigen::Vector2d& shift : shifts()) {
      const Eigen::Vector3f by(static_cast<float>(shift.x()), 0, static_cast<float>(shift.y()));
      const Eigen::MatrixXd now =
          phantom.envelope(phantom.moved([&](const Eigen::Vector3f& p) -> Eigen::Vector3f { return p + by; }));
      const reference::Match match = follow(phantom, still, now, kRigidHalf);
      worst_error = std::max(worst_error, (match.shift - shift).cwiseQuotient(pitch).cwiseAbs().maxCoeff());
      least_ncc = std::min(least_ncc, match.correlation);
    }
    for (std::size_t i = 0; i < kStrains.size(); ++i) {
      const auto strain = static_cast<float>(kStrains[i]), middle = static_cast<float>(kTrackedDepth);
      const Eigen::MatrixXd now = phantom.envelope(phantom.moved([&](const Eigen::Vector3f& p) -> Eigen::Vector3f {
        return {p.x(), p.y(), p.z() - strain * (p.z() - middle)};
      }));
      strained[i].push_back(follow(phantom, still, now, kStrainHalf).correlation);
    }
  }
};

}  // namespace

Report motion_quality(const QualityRun& run) {
  Tracking dense, sparse;
  for (int seed = 1; seed <= run.seeds; ++seed) {
    ultrasound::ImagerSettings settings = raw_settings(seed, false);
    PhantomScan own_lines(run.device, reference::uniform_phantom(), settings);
    sparse.add(own_lines);
    settings.line_oversampling = 2;
    PhantomScan twice(run.device, reference::uniform_phantom(), settings);
    dense.add(twice);
  }
  const char* conditions = "two lines a scan line, as clinical; scan-converted; raw; receiver noise off, before TGC";
  const char* sparse_conditions = "the probe's own 192 lines, 0.8 mm apart there: coarser than the speckle";
  Report report;
  report.add(noted(at_most("motion.rigid.worst_error", dense.worst_error, "sample", 1, 0.0),
                   fmt::format("2 mm along, across, both, 0.37 mm along; {}", conditions)));
  report.add(noted(at_least("motion.rigid.least_ncc", dense.least_ncc, "1", 0.95, 1.0), conditions));
  report.add({"motion.rigid.own_lines.worst_error", sparse.worst_error, "sample", 0.0, {}, {}, sparse_conditions});
  report.add({"motion.rigid.own_lines.least_ncc", sparse.least_ncc, "1", 1.0, {}, {}, sparse_conditions});
  const double theory = strain_theory(kStrains[0], kStrainHalf);
  report.add(noted(at_least("strain.3_percent.ncc", reference::moments(dense.strained[0]).mean, "1", 0.90, theory),
                   fmt::format("window of 8 mm, not stretched back; {}", conditions)));
  report.add({"strain.3_percent.own_lines.ncc",
              reference::moments(sparse.strained[0]).mean,
              "1",
              theory,
              {},
              {},
              sparse_conditions});
  report.add({"strain.10_percent.ncc",
              reference::moments(dense.strained[1]).mean,
              "1",
              strain_theory(kStrains[1], kStrainHalf),
              {},
              {},
              conditions});
  return report;
}

}  // namespace stylet::bench
