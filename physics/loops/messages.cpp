#include "physics/loops/messages.h"

namespace stylet::physics {

BodyPatch::BodyPatch()
    : node_ids(kMaxPatchNodes),
      free_positions(Eigen::Matrix3Xd::Zero(3, kMaxPatchNodes)),
      rotations(kMaxPatchNodes, Eigen::Quaterniond::Identity()),
      contacts(kMaxContacts),
      tet_ids(kMaxPatchTets),
      tet_nodes(kMaxPatchTets),
      tet_materials(kMaxPatchTets) {}

NeedleState::NeedleState()
    : positions(Eigen::Matrix3Xd::Zero(3, kMaxNeedleNodes)),
      orientations(kMaxNeedleNodes, Eigen::Quaterniond::Identity()),
      contacts(kMaxContacts),
      forces(static_cast<std::size_t>(kMaxBodies) * kMaxPatchNodes) {}

}  // namespace stylet::physics
