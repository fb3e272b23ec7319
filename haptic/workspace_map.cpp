#include "haptic/workspace_map.h"

namespace stylet::haptic {

void WorkspaceMap::follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  if (!engaged_) {
    engaged_ = true;
    hand_position_ = position;
    hand_orientation_ = orientation;
    hub_position_ = position_;
    hub_orientation_ = orientation_;
  }
  const Eigen::Quaterniond& axes = workspace_.patient_from_device;
  position_ = hub_position_ + workspace_.scale * (axes * (position - hand_position_));
  const Eigen::Quaterniond turned = orientation * hand_orientation_.conjugate();
  orientation_ = (axes * turned * axes.conjugate() * hub_orientation_).normalized();
}

}  // namespace stylet::haptic
