// How much of the needle an ultrasound image can show.
#pragma once

#include "engine/content/scene.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

namespace stylet::training {

/// Whether the beam sees a point of the probe frame: within the sector and the depth of the image, and nearer to its
/// plane than half the width of the beam there (full width at half maximum, engine/ultrasound/slice_thickness.h).
bool in_beam(const content::Probe& probe, const Eigen::Vector3d& point);

/// Whether a point of the probe frame is nearer to the image plane than half the beam's width at its depth.
bool in_plane(const content::Probe& probe, const Eigen::Vector3d& point);

/// Arc length of inserted needle in the beam, m: steps of half a millimetre along the chords between its nodes.
/// @param inserted  from the tip, m
double length_in_beam(const content::Probe& probe, const physics::RigidPose& pose, const physics::NeedleState& needle,
                      double inserted);

}  // namespace stylet::training
