// Whether the probe of a scene lies on the skin and looks into the patient.
#pragma once

#include "engine/content/scene.h"

#include <optional>
#include <string>

namespace stylet::content {

/// Farthest that the centre of the face may lie from the skin, m: gel and the dent of a pressed probe.
inline constexpr double kFarthestProbe = 0.010;

/// What is wrong with where the probe is held, or with the patient it is to meet (empty, in other units), without a
/// place; empty: its face lies on the skin and its axis meets the patient. The skin is where the labels change
/// between "outside" and the rest, to half a voxel. O(voxels).
std::string odd_probe_placement(const Probe& probe, const LabelVolume& labels);

/// The probe held on the skin at a point: its image holds `seen` and the needle's entry, the needle comes from the
/// left, and the face lies as flat on the skin as that allows, `seen` within 20 degrees of the image's middle. Where
/// the entry does not say how, across the body.
/// @param normal  of the skin, outwards, unit
physics::RigidPose probe_on_skin(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& seen, const Eigen::Vector3d& entry);

/// Angle between a direction and the beam through a point, rad, 0 to pi/2: beams of a convex probe spread from the
/// middle of its face's circle, those of a linear one are parallel. Patient frame.
double angle_to_beam(const Probe& probe, const Eigen::Vector3d& point, const Eigen::Vector3d& direction);

/// How a sonographer moves a probe on the skin: the slides first, then the turns, about axes of the probe (m, rad).
struct ProbeMove {
  double lateral = 0;    ///< slide along +X
  double elevation = 0;  ///< slide along +Y
  double press = 0;      ///< deeper into the skin
  double tilt = 0;       ///< about X: the image plane fans through the tissue
  double rock = 0;       ///< about Y: the image turns in its own plane
  double twist = 0;      ///< about Z

  bool operator==(const ProbeMove&) const = default;
};

/// The pose after a move on the skin at rest: the face stays as deep in it as it was, and turns with the skin's
/// slope. Nothing: there is no skin where the slide ends.
std::optional<physics::RigidPose> moved_on_skin(const physics::RigidPose& pose, const LabelVolume& labels,
                                                const ProbeMove& move);

/// The pose, drawn back along its axis until the face is no deeper than `deepest` (m) below the skin at rest.
/// Nothing: the face is inside the patient, far from the skin that it would have come through.
std::optional<physics::RigidPose> drawn_back(const physics::RigidPose& pose, const LabelVolume& labels,
                                             double deepest);

}  // namespace stylet::content
