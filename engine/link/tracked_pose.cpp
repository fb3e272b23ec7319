#include "engine/link/tracked_pose.h"

#include "engine/tracking/tracked_transforms.h"

namespace stylet::link {
namespace {

constexpr double kFarthest = 10;         // m
constexpr double kRotationSlack = 1e-2;  // trackers round, and send 32-bit floats

}  // namespace

std::optional<physics::RigidPose> patient_pose(const Eigen::Matrix4d& reference_from_tool) {
  const Eigen::Matrix3d rotation = reference_from_tool.topLeftCorner<3, 3>();
  const Eigen::Vector3d place = 1e-3 * reference_from_tool.topRightCorner<3, 1>();
  if (!rotation.allFinite() || !place.allFinite() || place.norm() > kFarthest) return {};
  const Eigen::Matrix3d product = rotation.transpose().lazyProduct(rotation);
  const double skew = (product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (skew > kRotationSlack || rotation.determinant() < 0) return {};
  const Eigen::Matrix3d patient_from_ras = tracking::ras_from_patient().transpose();
  physics::RigidPose pose;
  pose.position = patient_from_ras * place;
  pose.orientation = Eigen::Quaterniond(Eigen::Matrix3d(patient_from_ras * rotation)).normalized();
  return pose;
}

}  // namespace stylet::link
