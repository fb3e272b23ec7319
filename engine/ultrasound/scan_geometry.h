// Where the samples of the scan lines lie in the image plane, and where the picture shows them.
//
// Probe frame: origin at the centre of the face, +X lateral (picture right), +Z into the body, +Y elevation. The
// image plane is y = 0. A convex scan line at angle t from the axis has its sample at range r at
//   x = (R0 + r) sin t,  z = (R0 + r) cos t - R0.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>

namespace stylet::ultrasound {

/// Polar grid of the scan: `lines` scan lines of `samples` samples. Sample (line, sample) is a cell centre.
struct ScanGeometry {
  double face_radius = 0;   ///< R0 of a convex face, m; 0: linear
  double first_line = 0;    ///< angle of line 0, rad (convex) or its x, m (linear)
  double line_pitch = 0;    ///< rad or m
  double sample_pitch = 0;  ///< m
  int lines = 0;
  int samples = 0;

  /// @param oversampling  lines computed for each line the probe has
  static ScanGeometry of(const content::Probe& probe, int oversampling);

  double range(double sample) const { return (sample + 0.5) * sample_pitch; }
  double line_coordinate(double line) const { return first_line + line * line_pitch; }
  /// (x, z) in the probe frame of a fractional (line, sample).
  Eigen::Vector2d position(double line, double sample) const;
  /// Fractional (line, sample) of (x, z) in the probe frame: the inverse of position().
  Eigen::Vector2d line_and_sample(const Eigen::Vector2d& xz) const;
  /// Unit direction (x, z) of a line.
  Eigen::Vector2d direction(double line) const;
  /// Distance between neighbouring lines at a range, m.
  double lateral_pitch(double range) const;
  /// Smallest box (x, z) that holds all samples.
  void bounds(Eigen::Vector2d* low, Eigen::Vector2d* high) const;
};

/// The scan-converted picture: pixel (u, v), v down, centre at (origin + (u + 0.5, v + 0.5) * metres_per_pixel) in
/// (x, z) of the probe frame.
struct SectorGeometry {
  int width = 0;
  int height = 0;
  double metres_per_pixel = 0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< (x, z) of the picture's upper left corner, m

  /// The largest picture of `scan` that fits, centred.
  static SectorGeometry fit(const ScanGeometry& scan, int width, int height);

  double mm_per_pixel() const { return 1000 * metres_per_pixel; }
  /// Fractional pixel (pixel centres at integers) of (x, z) in the probe frame.
  Eigen::Vector2d pixel(const Eigen::Vector2d& xz) const {
    return (xz - origin) / metres_per_pixel - Eigen::Vector2d(0.5, 0.5);
  }
  /// (x, z) in the probe frame of a fractional pixel.
  Eigen::Vector2d position(const Eigen::Vector2d& uv) const {
    return origin + (uv + Eigen::Vector2d(0.5, 0.5)) * metres_per_pixel;
  }
};

/// Images a second of a scanner that sends line after line and waits for the echoes of each from `depth`, m:
///   1 / (lines (2 depth / c + t)), c = 1540 m/s, t the time to switch to the next line (engineering value).
double image_rate_hz(const content::Probe& probe, double depth);

}  // namespace stylet::ultrasound
