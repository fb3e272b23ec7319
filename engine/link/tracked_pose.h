// A pose as trackers say it, in the patient frame.
#pragma once

#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <optional>

namespace stylet::link {

/// @param reference_from_tool  millimetres; the reference is the patient in RAS, as in
///                             engine/tracking/tracked_transforms.h
/// @return the pose in metres; nothing: not a rotation and a place within 10 m (NaN, a scale, a mirror)
std::optional<physics::RigidPose> patient_pose(const Eigen::Matrix4d& reference_from_tool);

}  // namespace stylet::link
