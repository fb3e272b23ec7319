// What a user has measured of one device: where its hand rests, how it lies and how far it goes, what it shows at
// rest.
#pragma once

#include "haptic/hid/device_profile.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <optional>

namespace stylet::haptic::hid {

/// Kept for each device by its serial number (content/README.md, "stylet-calibration"). SI units.
struct Calibration {
  /// Of the hand where a session begins, device frame; nothing: it begins wherever the hand is.
  std::optional<Eigen::Vector3d> rest{};
  /// The user's right, up and towards the user from those of the device: how it lies on the desk.
  Eigen::Quaterniond user_from_device = Eigen::Quaterniond::Identity();
  double scale = 1;  ///< patient-frame length over device length
  /// Of axes that spring back, in the order of the reports (X Y Z Rx Ry Rz), parts of the full deflection. Nothing:
  /// the profile's.
  std::optional<std::array<double, 6>> centre{};
  std::optional<std::array<double, 6>> dead_zone{};
};

/// The profile with what was measured of its axes.
inline DeviceProfile calibrated(DeviceProfile profile, const Calibration& calibration) {
  if (calibration.centre) profile.centre = *calibration.centre;
  if (calibration.dead_zone) profile.dead_zone = *calibration.dead_zone;
  return profile;
}

}  // namespace stylet::haptic::hid
