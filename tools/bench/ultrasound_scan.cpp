#include "tools/bench/ultrasound_scan.h"

#include "engine/ultrasound/presets.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::bench {

ultrasound::ImagerSettings raw_settings(int seed, bool noise) {
  ultrasound::ImagerSettings settings = ultrasound::preset_settings(ultrasound::Preset::raw);
  settings.seed = static_cast<std::uint32_t>(seed);
  settings.depth_scale = false;
  if (!noise) settings.noise_db = -200;
  return settings;
}

PhantomScan::PhantomScan(gpu::Device& device, content::Scene scene, const ultrasound::ImagerSettings& settings)
    : scene_(std::move(scene)), rest_(reference::at_rest(scene_)), imager_(device, scene_, settings) {}

Eigen::MatrixXd PhantomScan::envelope(const state::FrameState& state) {
  imager_.image(state);
  const std::vector<float> values = imager_.read_back_envelope();
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(values.data(), scan().samples, scan().lines).cast<double>();
}

Eigen::MatrixXd PhantomScan::grey() {
  const std::vector<std::uint8_t> values = imager_.read_back();
  using Rows = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(values.data(), sector().height, sector().width).cast<double>();
}

picture::Picture PhantomScan::picture() {
  picture::Picture picture(sector().width, sector().height);
  const std::vector<std::uint8_t> values = imager_.read_back();
  for (std::size_t i = 0; i < values.size(); ++i) std::fill_n(picture.rgba.data() + 4 * i, 3, values[i]);
  return picture;
}

int PhantomScan::sample_at(double range) const {
  return std::clamp(static_cast<int>(std::lround(range / scan().sample_pitch - 0.5)), 0, scan().samples - 1);
}

Eigen::MatrixXd scan_converted(const Eigen::MatrixXd& envelope, const ultrasound::ScanGeometry& scan,
                               const Eigen::Vector2d& centre, double half, double pixel) {
  // Catmull and Rom's weights of four neighbours.
  const auto weights = [](double t) -> Eigen::Vector4d {
    const double t2 = t * t, t3 = t2 * t;
    return Eigen::Vector4d(-t3 + 2 * t2 - t, 3 * t3 - 5 * t2 + 2, -3 * t3 + 4 * t2 + t, t3 - t2) / 2;
  };
  const int n = static_cast<int>(std::lround(half / pixel));
  Eigen::MatrixXd image(2 * n + 1, 2 * n + 1);
  for (int u = -n; u <= n; ++u) {
    for (int v = -n; v <= n; ++v) {
      const Eigen::Vector2d at = scan.line_and_sample(centre + pixel * Eigen::Vector2d(u, v));
      const int line = std::clamp(static_cast<int>(std::floor(at.x())), 1, scan.lines - 3);
      const int sample = std::clamp(static_cast<int>(std::floor(at.y())), 1, scan.samples - 3);
      image(n + v, n + u) =
          weights(at.y() - sample).dot(envelope.block<4, 4>(sample - 1, line - 1) * weights(at.x() - line));
    }
  }
  return image;
}

}  // namespace stylet::bench
