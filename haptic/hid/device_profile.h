// What a report descriptor does not say of a device: how its axes lie, how fast it moves the needle, its data sheet.
#pragma once

#include "haptic/device.h"
#include "haptic/hid/report_descriptor.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

enum class DeviceKind : std::uint8_t {
  kUnusable,
  kStylus,      ///< absolute pose in six axes; with or without force
  kSpaceMouse,  ///< 6-DOF controller whose cap springs back: deflections, which become velocities
  kPen,         ///< pen on a tablet
  kJoystick,    ///< wheel or stick with force feedback: absolute, one to three axes
};

/// "force stylus", "space mouse", ...
const char* name_of(DeviceKind kind);

/// Who a device is.
struct DeviceIdentity {
  std::uint16_t vendor_id = 0;
  std::uint16_t product_id = 0;
  std::string product{};  ///< its name, UTF-8
};

/// What three rotations mean.
enum class RotationConvention : std::uint8_t {
  kRotationVector,  ///< axis times angle
  kEulerXyz,        ///< about the fixed X, then the fixed Y, then the fixed Z axis
};

/// Fixed reports of a device whose descriptor has vendor usages only: fields with the usages they should have had.
struct VendorReport {
  ReportType type = ReportType::kInput;
  std::uint8_t id = 0;
  std::uint32_t bytes = 0;      ///< with the id, where there is one
  std::vector<Field> fields{};  ///< bit offsets from the first bit after the id
};

/// Which devices a profile is for: all that is given must fit.
struct DeviceMatch {
  std::optional<std::uint16_t> vendor_id{};
  std::vector<std::uint16_t> product_ids{};  ///< empty: any
  std::string product{};                     ///< part of its name; empty: any
  /// What its descriptor makes it, or what the vendor reports of the profile do.
  std::optional<DeviceKind> kind{};
};

/// The axes of HID 1.11, 5.9: X from left to right, Y from far to near, Z from high to low.
inline Eigen::Matrix3d hid_axes() {
  return (Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
}

/// Read from content/devices/*.json (content/README.md). All in SI units.
///
/// Device frame: origin at the centre of the workspace, +X to the right, +Y up, +Z towards the trainee,
/// which is the room frame moved.
struct DeviceProfile {
  std::string name{};  ///< of the file, without .json

  std::vector<DeviceMatch> matches{};  ///< which devices: any of these

  std::string unusable{};  ///< why it cannot be used, one line; empty: it can

  /// Device frame from X, Y, Z of the reports: a signed permutation. Forces go back the same way.
  Eigen::Matrix3d device_from_report = hid_axes();
  /// The same for the axes that Rx, Ry, Rz turn about, by the right hand.
  Eigen::Matrix3d rotation_from_report = hid_axes();
  /// Of the needle while Rx, Ry, Rz are 0: columns are its axes in the device frame. By default it points down.
  Eigen::Matrix3d device_from_needle_at_rest = hid_axes();
  RotationConvention rotation = RotationConvention::kRotationVector;
  double scale = 1;  ///< of the positions
  /// Half the box that axes without a length cover, in the axes of the reports, m.
  Eigen::Vector3d workspace_half_m = Eigen::Vector3d::Constant(0.08);

  // Of space mice, at full deflection.
  double full_speed_m_per_s = 0.05;
  double full_angular_speed_rad_per_s = 0.8;
  /// What each axis of the reports shows at rest, and what about it is no motion; parts of the full deflection.
  std::array<double, 6> centre{};
  std::array<double, 6> dead_zone{0.05, 0.05, 0.05, 0.05, 0.05, 0.05};

  double force_sign = 1;  ///< -1: its firmware pushes the other way
  /// N at the end of the range of force fields that say no newtons; 0: the largest force of the limits.
  double full_scale_force_n = 0;

  std::optional<DeviceLimits> limits{};  ///< data sheet; nothing: the defaults, with the forces the descriptor gives
  double force_timeout_s = 0;  ///< without an output report until it drops the force itself; 0: it never does

  std::vector<VendorReport> vendor_reports{};

  /// How closely it fits: of several profiles the one with most is taken. 0: not this device.
  int match(const DeviceIdentity& identity, DeviceKind described) const;
};

/// The descriptor with the vendor reports of the profile in place of those it declares under the same ids.
ReportDescriptor with_vendor_reports(ReportDescriptor descriptor, const DeviceProfile& profile);

}  // namespace stylet::haptic::hid
