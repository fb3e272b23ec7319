// The stylus, whatever makes it move: HID device, recorded motion, script, mouse.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <string>

namespace stylet::haptic {

/// A reading of the stylus. Position of the needle hub and rotation needle frame -> patient frame, after the device's
/// own workspace mapping.
struct StylusSample {
  double time_s = 0;                                   ///< session time of the reading
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::uint32_t buttons = 0;
  bool valid = false;  ///< false: no device, or stale beyond the limit
};

/// Limits of a device, from its data sheet.
struct DeviceLimits {
  double max_force_n = 3.3;
  double max_torque_nm = 0.0;          ///< 0: the device renders no torque
  double max_stiffness_n_per_m = 500;  ///< at 1 kHz
  double max_force_rate_n_per_s = 1000;
};

/// A stylus. read() and write() are called by the haptic thread only.
class Device {
public:
  virtual ~Device() = default;
  virtual std::string name() const = 0;
  virtual DeviceLimits limits() const = 0;
  /// Latest pose at session time `now_s`.
  /// @realtime no allocation, no lock, never blocks
  virtual StylusSample read(double now_s) = 0;
  /// Force on the hand (N, patient frame) and torque (N m). Already limited by OutputGuard.
  /// @realtime no allocation, no lock, never blocks
  virtual void write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) = 0;
};

}  // namespace stylet::haptic
