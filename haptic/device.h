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
  bool valid = false;  ///< false: no device, no pose yet, clutched, or a gap in the reports
  double age_s = 0;    ///< of the pose at the reading: since the report that it is from came in
};

/// Limits of a device, from its data sheet. The defaults are those of a 3D Systems Touch, or where its data sheet is
/// silent what haptic/README.md derives. Forces and torques are norms.
struct DeviceLimits {
  bool renders_force =
      false;  ///< false: what is written to it moves nothing, and it prescribes the pose of the needle

  // What the motors give.
  double max_force_n = 3.3;
  double continuous_force_n = 0.88;     ///< that they hold for ever without overheating
  double max_torque_nm = 0.0;           ///< 0: the device renders no torque
  double continuous_torque_nm = 0.0;    ///< 0: as max_torque_nm
  double thermal_time_constant_s = 10;  ///< of the windings
  double max_force_rate_n_per_s = 1000;
  double max_torque_rate_nm_per_s = 50;

  // What stays stable at 1 kHz.
  double max_stiffness_n_per_m = 500;
  double max_damping_n_s_per_m = 4;
  double max_rotational_stiffness_nm_per_rad = 1;  ///< of devices with torque
  double max_rotational_damping_nm_s_per_rad = 0.004;
  double physical_damping_n_s_per_m = 0.5;  ///< of its mechanics and the lightest grip, without motors
  double loop_delay_s = 0.0015;  ///< from the motion to the force that answers it, beyond the sample period

  // How it is moved.
  double max_speed_m_per_s = 1.0;      ///< faster is a device let go or thrown: trips
  double max_position_jump_m = 0.010;  ///< between two readings: trips
  double max_rotation_jump_rad = 0.3;  ///< the same; a hand turns a needle by at most some 30 rad/s

  // How long old data count.
  double stale_pose_fade_s = 0.005;  ///< age of the pose at which the force begins to fade
  double stale_pose_zero_s = 0.020;  ///< and is zero
  double stale_patch_fade_s = 0.2;   ///< the same for the age of the tissue patch
  double stale_patch_zero_s = 0.5;

  // How the force comes on.
  double engage_force_n = 0.2;  ///< it engages below this
  double engage_rise_s = 0.5;   ///< and rises to full in this time
};

/// Limits of a device whose workspace mapping multiplies positions, not forces: seen from the patient frame.
/// @param scale  patient-frame length over device length
inline DeviceLimits limits_in_patient_frame(DeviceLimits limits, double scale) {
  limits.max_stiffness_n_per_m /= scale;
  limits.max_damping_n_s_per_m /= scale;
  limits.physical_damping_n_s_per_m /= scale;
  limits.max_speed_m_per_s *= scale;
  limits.max_position_jump_m *= scale;
  return limits;
}

/// What whoever holds the stylus should know.
struct DeviceStatus {
  bool connected = true;        ///< false: it was pulled out; on its return it is taken up where it is
  bool waits_for_rest = false;  ///< the session begins when the hand comes to its rest place
  std::string needs{};          ///< what the user should do before it can lead or push, one line; empty: nothing
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
  /// Any thread.
  virtual DeviceStatus status() const { return {}; }
  /// Counts of a session in one line; empty: it counts nothing. Any thread.
  virtual std::string statistics() const { return {}; }
};

}  // namespace stylet::haptic
