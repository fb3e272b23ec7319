#include "engine/ultrasound/scan_geometry.h"

#include <algorithm>
#include <cmath>

namespace stylet::ultrasound {

ScanGeometry ScanGeometry::of(const content::Probe& probe, int oversampling) {
  ScanGeometry scan;
  scan.lines = probe.scan_lines * oversampling;
  scan.samples = probe.samples;
  scan.sample_pitch = probe.depth / probe.samples;
  scan.face_radius = probe.convex ? probe.radius : 0.0;
  const double extent = probe.convex ? probe.field_of_view : probe.width;
  scan.line_pitch = extent / scan.lines;
  scan.first_line = 0.5 * (scan.line_pitch - extent);
  return scan;
}

Eigen::Vector2d ScanGeometry::position(double line, double sample) const {
  const double r = range(sample);
  const double c = line_coordinate(line);
  if (face_radius == 0) return {c, r};
  return {(face_radius + r) * std::sin(c), (face_radius + r) * std::cos(c) - face_radius};
}

Eigen::Vector2d ScanGeometry::line_and_sample(const Eigen::Vector2d& xz) const {
  double c = xz.x();
  double r = xz.y();
  if (face_radius != 0) {
    c = std::atan2(xz.x(), xz.y() + face_radius);
    r = std::hypot(xz.x(), xz.y() + face_radius) - face_radius;
  }
  return {(c - first_line) / line_pitch, r / sample_pitch - 0.5};
}

Eigen::Vector2d ScanGeometry::direction(double line) const {
  if (face_radius == 0) return {0, 1};
  const double c = line_coordinate(line);
  return {std::sin(c), std::cos(c)};
}

double ScanGeometry::lateral_pitch(double range) const {
  return face_radius == 0 ? line_pitch : (face_radius + range) * line_pitch;
}

void ScanGeometry::bounds(Eigen::Vector2d* low, Eigen::Vector2d* high) const {
  const double half = -first_line + 0.5 * line_pitch;
  const double depth = samples * sample_pitch;
  if (face_radius == 0) {
    *low = {-half, 0};
    *high = {half, depth};
  } else {
    const double x = (face_radius + depth) * std::sin(std::min(half, 0.5 * double(EIGEN_PI)));
    *low = {-x, face_radius * (std::cos(half) - 1)};
    *high = {x, depth};
  }
}

SectorGeometry SectorGeometry::fit(const ScanGeometry& scan, int width, int height) {
  // A margin for the depth scale at the sides and a line of black above and below.
  constexpr double kUsedWidth = 0.94;
  constexpr double kUsedHeight = 0.96;
  Eigen::Vector2d low;
  Eigen::Vector2d high;
  scan.bounds(&low, &high);
  const Eigen::Vector2d size = high - low;
  SectorGeometry sector;
  sector.width = width;
  sector.height = height;
  sector.metres_per_pixel = std::max(size.x() / (kUsedWidth * width), size.y() / (kUsedHeight * height));
  sector.origin = 0.5 * (low + high) - 0.5 * sector.metres_per_pixel * Eigen::Vector2d(width, height);
  return sector;
}

double image_rate_hz(const content::Probe& probe, double depth) {
  constexpr double kSpeedOfSound = 1540;  // m/s
  constexpr double kSwitching = 30e-6;    // s
  return 1 / (probe.scan_lines * (2 * depth / kSpeedOfSound + kSwitching));
}

}  // namespace stylet::ultrasound
