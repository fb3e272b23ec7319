// How the hand's motion becomes the needle's: axes, scale, and a reference that can be taken anew.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

namespace stylet::haptic {

/// Device frame: X right, Y up, Z towards the user, m.
struct Workspace {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< of the hub before the first engagement, patient frame, m
  Eigen::Quaterniond start_orientation = Eigen::Quaterniond::Identity();  ///< needle frame -> patient frame
  Eigen::Quaterniond patient_from_device = Eigen::Quaterniond::Identity();
  double scale = 1;  ///< patient-frame length over device length
  /// Of the hand, device frame, m: the first engagement is there; nothing: it is wherever the hand is.
  std::optional<Eigen::Vector3d> rest{};
};

/// While engaged the hub follows the hand from where both were at the engagement:
///   x_v = x_v0 + s R (x_d - x_d0),   q_v = R (q_d q_d0^-1) R^-1 q_v0,   R = patient_from_device,
/// so that nothing jumps when a clutch is let go or a device returns: the hub stays where it is, and turns about the
/// axes the hand turns about. Released, it stays.
/// @realtime
class WorkspaceMap {
public:
  explicit WorkspaceMap(const Workspace& workspace)
      : workspace_(workspace), position_(workspace.start), orientation_(workspace.start_orientation.normalized()) {}

  /// The next pose of the hand is the new reference.
  void release() { engaged_ = false; }
  /// @param position, orientation  of the hand, device frame
  void follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation);

  const Eigen::Vector3d& position() const { return position_; }
  const Eigen::Quaterniond& orientation() const { return orientation_; }
  /// A force or torque of the patient frame in the device's.
  Eigen::Vector3d to_device(const Eigen::Vector3d& vector) const {
    return workspace_.patient_from_device.conjugate() * vector;
  }

private:
  Workspace workspace_;
  bool engaged_ = false;
  Eigen::Vector3d position_;
  Eigen::Quaterniond orientation_;
  // At the engagement.
  Eigen::Vector3d hand_position_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond hand_orientation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d hub_position_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond hub_orientation_ = Eigen::Quaterniond::Identity();
};

}  // namespace stylet::haptic
