#include "engine/content/probe_placement.h"

#include "physics/messages/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace stylet::content {
namespace {

constexpr double kLargestPatient = 5;  // m
constexpr double kSmallestPatient = 0.02;
constexpr double kMostAside =
    20 * std::numbers::pi / 180;  // of what the probe is to see from the middle of its image
constexpr double kNoPlane = 0.1;  // sine of the least angle between two directions that make a plane

std::size_t index_of(const LabelVolume& labels, const Eigen::Vector3i& voxel) {
  const auto nx = static_cast<std::size_t>(labels.size.x());
  const auto ny = static_cast<std::size_t>(labels.size.y());
  return (static_cast<std::size_t>(voxel.z()) * ny + static_cast<std::size_t>(voxel.y())) * nx +
         static_cast<std::size_t>(voxel.x());
}

bool in_patient(const LabelVolume& labels, const Eigen::Vector3d& point) {
  const Eigen::Vector3d grid = (point - labels.origin.cast<double>()) / labels.spacing;
  if ((grid.array() < -0.5).any() || (grid.array() > labels.size.cast<double>().array() - 0.5).any()) return false;
  const Eigen::Vector3i voxel = grid.array().round().cast<int>().max(0).min(labels.size.array() - 1);
  return labels.labels[index_of(labels, voxel)] != 0;
}

/// From `point` to the nearest voxel centre on the other side of the skin; infinite where there is none.
double to_other_side(const LabelVolume& labels, const Eigen::Vector3d& point, bool inside) {
  const Eigen::Vector3d grid = (point - labels.origin.cast<double>()) / labels.spacing;
  double best = std::numeric_limits<double>::infinity();
  if (inside) {  // beyond the volume is outside
    best = std::min((grid.array() + 1).minCoeff(), (labels.size.cast<double>().array() - grid.array()).minCoeff());
    best *= best;
  }
  std::size_t index = 0;
  for (int z = 0; z < labels.size.z(); ++z) {
    for (int y = 0; y < labels.size.y(); ++y) {
      const double row = (z - grid.z()) * (z - grid.z()) + (y - grid.y()) * (y - grid.y());
      if (row >= best) {
        index += static_cast<std::size_t>(labels.size.x());
        continue;
      }
      for (int x = 0; x < labels.size.x(); ++x, ++index) {
        if ((labels.labels[index] != 0) != inside) best = std::min(best, row + (x - grid.x()) * (x - grid.x()));
      }
    }
  }
  return std::sqrt(best) * labels.spacing;
}

/// Where a face far from the skin belongs, if its position is a thousand times the right one or a thousandth of it.
std::string advice(const LabelVolume& labels, const Eigen::Vector3d& face, double distance) {
  const auto on_skin = [&labels](const Eigen::Vector3d& point) {
    return to_other_side(labels, point, in_patient(labels, point)) <= kFarthestProbe + labels.spacing;
  };
  if (distance > kLargestPatient && on_skin(1e-3 * face)) return "its position looks like millimetres: write metres";
  if (face.norm() < 1e-3 * kLargestPatient && on_skin(1e3 * face)) {
    return "its position looks 1000 times too small: write metres";
  }
  return "move it onto the skin";
}

constexpr double kSkinReach = 0.040;   // m before and behind the face in which skin is looked for
constexpr double kSkinStep = 0.25e-3;  // m
constexpr double kSlopeReach = 0.015;  // m; the slope under a face of some centimetres, not of a wrinkle

/// From `point` along `direction` to the skin, negative where it lies before the point, m.
std::optional<double> to_skin(const LabelVolume& labels, const Eigen::Vector3d& point,
                              const Eigen::Vector3d& direction) {
  if (in_patient(labels, point - kSkinReach * direction)) return {};
  for (double t = -kSkinReach; t <= kSkinReach; t += kSkinStep) {
    if (in_patient(labels, point + t * direction)) return t;
  }
  return {};
}

/// Normal of the skin under the face, outwards, in the frame of the probe.
std::optional<Eigen::Vector3d> skin_normal(const LabelVolume& labels, const Eigen::Vector3d& point,
                                           const Eigen::Matrix3d& axes) {
  Eigen::Vector3d normal(0, 0, -1);
  for (int axis = 0; axis < 2; ++axis) {
    const auto ahead = to_skin(labels, point + kSlopeReach * axes.col(axis), axes.col(2));
    const auto behind = to_skin(labels, point - kSlopeReach * axes.col(axis), axes.col(2));
    if (!ahead || !behind) return {};
    normal[axis] = (*ahead - *behind) / (2 * kSlopeReach);
  }
  return normal.normalized();
}

}  // namespace

std::optional<physics::RigidPose> moved_on_skin(const physics::RigidPose& pose, const LabelVolume& labels,
                                                const ProbeMove& move) {
  const Eigen::Matrix3d axes = pose.orientation.toRotationMatrix();
  const Eigen::Vector3d slid = pose.position + move.lateral * axes.col(0) + move.elevation * axes.col(1);
  const auto depth_before = to_skin(labels, pose.position, axes.col(2));
  const auto depth = to_skin(labels, slid, axes.col(2));
  const auto normal_before = skin_normal(labels, pose.position, axes);
  const auto normal = skin_normal(labels, slid, axes);
  if (!depth_before || !depth || !normal_before || !normal) return {};
  const Eigen::Quaterniond slope = physics::rotation_between(*normal_before, *normal);
  const Eigen::Quaterniond turned = pose.orientation * slope;
  const Eigen::Vector3d skin = slid + *depth * axes.col(2);
  physics::RigidPose moved;
  moved.position = skin + (move.press - *depth_before) * (turned * Eigen::Vector3d::UnitZ());
  moved.orientation = turned * Eigen::AngleAxisd(move.twist, Eigen::Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(move.rock, Eigen::Vector3d::UnitY()) *
                      Eigen::AngleAxisd(move.tilt, Eigen::Vector3d::UnitX());
  return moved;
}

std::optional<physics::RigidPose> drawn_back(const physics::RigidPose& pose, const LabelVolume& labels,
                                             double deepest) {
  if (!in_patient(labels, pose.position)) return pose;
  const Eigen::Vector3d axis = pose.orientation * Eigen::Vector3d::UnitZ();
  const std::optional<double> skin = to_skin(labels, pose.position, axis);
  if (!skin) return {};
  physics::RigidPose back = pose;
  back.position += std::min(*skin + deepest, 0.0) * axis;
  return back;
}

std::string odd_probe_placement(const Probe& probe, const LabelVolume& labels) {
  if (std::ranges::all_of(labels.labels, [](std::uint8_t label) { return label == 0; })) {
    return "the patient's label volume holds no tissue to image; check that its organs are closed surfaces";
  }
  const double extent = double(labels.spacing) * labels.size.maxCoeff();
  if (extent > kLargestPatient || extent < kSmallestPatient) {
    return fmt::format("the patient is {:.3g} m across; its files must be in metres", extent);
  }
  const Eigen::Vector3d face = probe.pose.position;
  const bool inside = in_patient(labels, face);
  const double distance = to_other_side(labels, face, inside);
  if (distance > kFarthestProbe + labels.spacing) {
    return fmt::format("the probe's face lies {:.0f} mm {} the skin; {}", distance * 1e3, inside ? "below" : "from",
                       advice(labels, face, distance));
  }
  const Eigen::Vector3d axis = probe.pose.orientation * Eigen::Vector3d::UnitZ();
  bool behind = false;
  for (double depth = 0; depth <= probe.depth; depth += 0.5 * labels.spacing) {
    if (in_patient(labels, face + depth * axis)) return {};
    behind = behind || in_patient(labels, face - depth * axis);
  }
  return fmt::format("the probe's axis (+Z) does not meet the patient{}",
                     behind ? ", which lies behind it; turn it round" : "; turn it towards the skin");
}

physics::RigidPose probe_on_skin(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& seen, const Eigen::Vector3d& entry) {
  const Eigen::Vector3d to_seen = (seen - point).normalized();
  const Eigen::Vector3d to_entry = (entry - point).normalized();
  Eigen::Vector3d across = to_entry.cross(to_seen);
  if (!(across.norm() > kNoPlane)) across = Eigen::Vector3d::UnitY().cross(to_seen).cross(to_seen);
  if (!(across.norm() > kNoPlane)) across = to_seen.unitOrthogonal();
  across.normalize();
  Eigen::Vector3d axis = normal.dot(across) * across - normal;
  axis = axis.norm() > kNoPlane ? Eigen::Vector3d(axis.normalized()) : to_seen;
  const double aside = std::acos(std::clamp(axis.dot(to_seen), -1.0, 1.0));
  if (aside > kMostAside) {
    axis = Eigen::AngleAxisd(aside - kMostAside, axis.cross(to_seen).normalized()) * axis;
  }
  Eigen::Matrix3d frame;
  frame.col(2) = axis;
  frame.col(0) = across.cross(axis);
  if (frame.col(0).dot(to_entry) > 0) frame.col(0) = -frame.col(0);
  frame.col(1) = axis.cross(frame.col(0));
  return {.position = point, .orientation = Eigen::Quaterniond(frame).normalized()};
}

double angle_to_beam(const Probe& probe, const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d axis = probe.pose.orientation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d beam =
      probe.convex ? Eigen::Vector3d(point - probe.pose.position + probe.radius * axis) : axis;
  return std::atan2(beam.cross(direction).norm(), std::abs(beam.dot(direction)));
}

}  // namespace stylet::content
