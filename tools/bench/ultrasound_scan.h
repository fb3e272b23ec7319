// A virtual test object under the probe, imaged on the GPU: images as arrays, and where their samples lie.
#pragma once

#include "engine/content/scene.h"
#include "engine/gpu/device.h"
#include "engine/picture/picture.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/imager.h"
#include "tools/reference/ultrasound_phantom.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::bench {

/// Preset raw: one look, no texture, no haze; the picture bears no marks.
/// @param noise  receiver noise as it is in a session, else none
ultrasound::ImagerSettings raw_settings(int seed, bool noise);

class PhantomScan {
public:
  PhantomScan(gpu::Device& device, content::Scene scene, const ultrasound::ImagerSettings& settings);
  PhantomScan(const PhantomScan&) = delete;
  PhantomScan& operator=(const PhantomScan&) = delete;

  const state::FrameState& rest() const { return rest_; }
  /// At rest but for the nodes, each moved to `move`(position).
  template <typename Move>
  state::FrameState moved(Move&& move) const {
    state::FrameState state = rest_;
    for (Eigen::Vector3f& p : state.bodies.at(0)) p = move(p);
    return state;
  }
  /// Linear envelope before depth gain and compression [samples x lines], 1 = rms of liver.
  Eigen::MatrixXd envelope(const state::FrameState& state);
  Eigen::MatrixXd envelope() { return envelope(rest_); }
  /// Grey values of the scan-converted picture of the last envelope [height x width].
  Eigen::MatrixXd grey();
  picture::Picture picture();

  const ultrasound::ScanGeometry& scan() const { return imager_.scan(); }
  const ultrasound::SectorGeometry& sector() const { return imager_.geometry(); }
  const content::Scene& scene() const { return scene_; }
  double wavelength() const { return 1540 / scene_.probe.frequency_hz; }
  /// Sample nearest to a range, m.
  int sample_at(double range) const;

private:
  content::Scene scene_;
  state::FrameState rest_;
  ultrasound::Imager imager_;
};

/// The envelope scan-converted, linear: the square of edge 2 `half` around `centre` (x, z), m, in pixels of `pixel`.
/// Cubic between samples. Centred on pixel (n, n), n = half / pixel.
Eigen::MatrixXd scan_converted(const Eigen::MatrixXd& envelope, const ultrasound::ScanGeometry& scan,
                               const Eigen::Vector2d& centre, double half, double pixel);

/// Amplitudes of an envelope where `wanted`(x, z), m.
template <typename Wanted>
std::vector<double> amplitudes(const Eigen::MatrixXd& envelope, const ultrasound::ScanGeometry& scan,
                               Wanted&& wanted) {
  std::vector<double> values;
  for (int l = 0; l < scan.lines; ++l) {
    for (int s = 0; s < scan.samples; ++s) {
      const Eigen::Vector2d at = scan.position(l, s);
      if (wanted(at.x(), at.y())) values.push_back(envelope(s, l));
    }
  }
  return values;
}

}  // namespace stylet::bench
