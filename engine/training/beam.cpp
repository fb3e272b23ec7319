#include "engine/training/beam.h"

#include "engine/ultrasound/slice_thickness.h"

#include <algorithm>
#include <cmath>

namespace stylet::training {
namespace {

constexpr double kStep = 0.5e-3;  // m

/// Depth below the face along a scan line.
double range(const content::Probe& probe, const Eigen::Vector3d& point) {
  if (!probe.convex) return point.z();
  return std::hypot(point.x(), point.z() + probe.radius) - probe.radius;
}

}  // namespace

bool in_plane(const content::Probe& probe, const Eigen::Vector3d& point) {
  return std::abs(point.y()) < ultrasound::elevation_fwhm(probe, range(probe, point)) / 2;
}

bool in_beam(const content::Probe& probe, const Eigen::Vector3d& point) {
  const double depth = range(probe, point);
  const bool in_sector = probe.convex
                             ? std::abs(std::atan2(point.x(), point.z() + probe.radius)) <= probe.field_of_view / 2
                             : std::abs(point.x()) <= probe.width / 2;
  return in_sector && depth >= 0 && depth <= probe.depth && in_plane(probe, point);
}

double length_in_beam(const content::Probe& probe, const physics::RigidPose& pose, const physics::NeedleState& needle,
                      double inserted) {
  const Eigen::Quaterniond probe_from_patient = pose.orientation.conjugate();
  double seen = 0;
  double left = inserted;
  for (int node = needle.node_count - 1; node > 0 && left > 0; --node) {
    const Eigen::Vector3d from = probe_from_patient * (needle.positions.col(node) - pose.position);
    const Eigen::Vector3d to = probe_from_patient * (needle.positions.col(node - 1) - pose.position);
    const double chord = (to - from).norm();
    const double length = std::min(chord, left);
    const int steps = static_cast<int>(std::ceil(length / kStep));
    for (int i = 0; i < steps; ++i) {
      const double along = (i + 0.5) * length / steps;
      if (in_beam(probe, from + along / chord * (to - from))) seen += length / steps;
    }
    left -= length;
  }
  return seen;
}

}  // namespace stylet::training
