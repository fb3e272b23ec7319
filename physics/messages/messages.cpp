#include "physics/messages/messages.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {

BodyPatch::BodyPatch()
    : node_ids(kMaxPatchNodes),
      free_positions(Eigen::Matrix3Xd::Zero(3, kMaxPatchNodes)),
      rest_positions(Eigen::Matrix3Xd::Zero(3, kMaxPatchNodes)),
      surroundings(kMaxPatchNodes),
      contacts(kMaxContacts),
      tet_ids(kMaxPatchTets),
      tet_nodes(kMaxPatchTets),
      tet_neighbours(kMaxPatchTets) {}

Eigen::MatrixXd BodyPatch::w_bar() const {
  Eigen::MatrixXd w(3 * node_count, 3 * node_count);
  for (int j = 0; j < node_count; ++j) {
    for (int i = 0; i < node_count; ++i) w.block<3, 3>(3 * i, 3 * j) = w_bar(i, j);
  }
  return w;
}

void BodyPatch::set_w_bar(const Eigen::MatrixXd& w) {
  if (w_bar_values.size() < kMaxWBarValues) w_bar_values.assign(kMaxWBarValues, 0.0);
  for (int j = 0; j < node_count; ++j) {
    for (int i = 0; i < node_count; ++i) w_bar(i, j) = w.block<3, 3>(3 * i, 3 * j);
  }
}

Eigen::Vector3d BodyPatch::free_position(const PatchContact& contact) const {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) position += contact.barycentric[k] * free_positions.col(contact.patch_nodes[k]);
  return position;
}

Eigen::Matrix3d BodyPatch::compliance(const PatchContact& i, const PatchContact& j) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int l = 0; l < 4; ++l) {
    for (int k = 0; k < 4; ++k) {
      sum += (i.barycentric[k] * j.barycentric[l]) * w_bar(i.patch_nodes[k], j.patch_nodes[l]);
    }
  }
  return sum;
}

void BodyPatch::condense() {
  if (contact_values.size() < kMaxContactValues) contact_values.assign(kMaxContactValues, 0.0);
  for (int j = 0; j < contact_count; ++j) {
    PatchContact& laid = contacts[j];
    laid.free_position = free_position(laid);
    for (int i = 0; i <= j; ++i) contact_compliance(i, j) = compliance(contacts[i], laid);
  }
}

void OrganRows::reserve(int body_count) {
  gap.setZero(kMaxOrganRows);
  lambda.setZero(kMaxOrganRows);
  w.setZero(kMaxOrganRows, kMaxOrganRows);
  for (int b = 0; b < body_count; ++b) y[b].setZero(kMaxOrganRows, std::ptrdiff_t{3} * kMaxPatchNodes);
}

NeedleState::NeedleState()
    : positions(Eigen::Matrix3Xd::Zero(3, kMaxNeedleNodes)),
      orientations(kMaxNeedleNodes, Eigen::Quaterniond::Identity()),
      contacts(kMaxContacts),
      forces(static_cast<std::size_t>(kMaxBodies) * kMaxPatchNodes) {}

void copy_state(const NeedleState& from, NeedleState& to) {
  to.step = from.step;
  to.patch_epoch = from.patch_epoch;
  to.time_s = from.time_s;
  to.flags = from.flags;
  to.node_count = from.node_count;
  to.positions.leftCols(from.node_count) = from.positions.leftCols(from.node_count);
  std::copy_n(from.orientations.begin(), from.node_count, to.orientations.begin());
  to.tip = from.tip;
  to.tip_body = from.tip_body;
  to.tip_depth = from.tip_depth;
  to.contact_count = from.contact_count;
  to.track_count = from.track_count;
  std::copy_n(from.contacts.begin(), std::max(from.contact_count, from.track_count), to.contacts.begin());
  to.puncture_count = from.puncture_count;
  to.last_puncture = from.last_puncture;
  to.force_count = from.force_count;
  std::copy_n(from.forces.begin(), from.force_count, to.forces.begin());
  to.wrench = from.wrench;
  to.hand_work = from.hand_work;
  to.damage = from.damage;
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized();
  const Eigen::Vector3d b = to.normalized();
  const double cosine = b.dot(a);
  if (cosine < -1 + 1e-12) {
    const Eigen::Vector3d across = a.unitOrthogonal();
    return Eigen::Quaterniond(0, across.x(), across.y(), across.z());
  }
  const double twice = std::sqrt((1 + cosine) * 2);  // of the cosine of half the angle
  Eigen::Quaterniond rotation;
  rotation.vec() = a.cross(b) * (1 / twice);
  rotation.w() = twice * 0.5;
  return rotation;
}

}  // namespace stylet::physics
