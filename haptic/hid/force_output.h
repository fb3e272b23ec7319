// Forces made into output reports: PID Download Force Sample, or constant-force effects where there is nothing else.
#pragma once

#include "haptic/hid/device_profile.h"
#include "haptic/hid/report_field.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace stylet::haptic::hid {

/// What a device is told to do with its motors (PID Device Control). Disabled motors push no force at all.
enum class DeviceControl : std::uint8_t { kEnableActuators, kDisableActuators, kStopAll, kReset };

/// The calls of hidapi, bytes with the id first; what is false or negative has failed.
struct ReportPort {
  std::function<bool(std::span<const std::uint8_t>)> write;
  std::function<bool(std::span<const std::uint8_t>)> set_feature;
  std::function<int(std::span<std::uint8_t>)> get_feature;
};

class ForceOutput {
public:
  enum class Way : std::uint8_t { kNone, kForceSample, kConstantForce };

  struct Axis {
    Field field{};           ///< of the sample, or the magnitude of the constant force
    int index = 0;           ///< X Y Z Rx Ry Rz
    double range = 0;        ///< N or N m at the end of the logical range
    double scale = 1;        ///< N or N m a logical unit
    double offset = 0;       ///< N or N m at logical 0
    std::uint8_t block = 0;  ///< of the effect, once start() has made it
  };

  static constexpr double kMostHeld = 0.020;  ///< s after its host died that a device may push: haptic/README.md
  /// s that a constant force lasts unless it is started again; 2 ms are left for a firmware that counts them whole.
  static constexpr double kEffectDuration = 0.018;

  /// Not for running loops.
  ForceOutput(const ReportDescriptor& descriptor, const DeviceProfile& profile);

  Way way() const { return way_; }
  const std::vector<Axis>& axes() const { return axes_; }
  /// The profile's data sheet, or the defaults, with the force no higher than the reports can carry.
  const DeviceLimits& limits() const { return limits_; }

  /// How long the device pushes on, s, when its host falls silent: until the effects run out, or the firmware's own
  /// time-out (DeviceProfile). 0: for ever.
  double held_s() const;
  /// Whether a host that dies leaves a force no longer than kMostHeld.
  bool lets_go() const { return way_ == Way::kNone || (held_s() > 0 && held_s() <= kMostHeld); }

  /// Gains, effects and all else that comes before the first force; the motors stay off. Where it fails, constant
  /// forces are not to be written. Waits for the bus.
  /// @return what failed, one line; empty: nothing
  std::string start(const ReportPort& port);

  /// Effects to be started again every renew_s() while forces are written: each report of a force changes the size of
  /// an effect, and does not make it last. None for samples, and before start().
  int renewal_count() const { return static_cast<int>(renewals_.size()); }
  double renew_s() const { return effect_s_ / 3; }  // one may be late by two thirds
  /// @realtime the bytes of report `index`, as start() made them
  std::span<const std::uint8_t> renewal(int index) const { return renewals_[static_cast<std::size_t>(index)]; }

  /// How many reports a force takes: one sample, or one for each effect.
  int report_count() const;
  /// Longest of them, with the id byte.
  std::size_t max_report_bytes() const { return max_bytes_; }
  /// Report `index` of a force on the hand: what the device has no axis for is left out, what is beyond its range
  /// stops at its end, and what is not finite is none.
  /// @param force   N, device frame
  /// @param torque  N m, device frame
  /// @return bytes to write; 0: `out` is too small, or there is no such report
  /// @realtime no allocation, no exception
  std::size_t encode(int index, const Eigen::Vector3d& force, const Eigen::Vector3d& torque,
                     std::span<std::uint8_t> out) const noexcept;

  /// @return bytes to write; 0: the device knows no such control
  /// @realtime no allocation, no exception
  std::size_t encode(DeviceControl control, std::span<std::uint8_t> out) const noexcept;

private:
  struct Control {
    Field field{};
    std::int64_t value = 0;
    bool known = false;
  };
  struct Layout {
    std::uint8_t id = 0;
    std::uint32_t bytes = 0;  // with the id byte, which hidapi wants even where it is 0
  };

  Layout layout(const ReportDescriptor& descriptor, const Field& field) const;
  void find_force_sample(const ReportDescriptor& descriptor);
  void find_constant_force(const ReportDescriptor& descriptor);
  void find_controls(const ReportDescriptor& descriptor);

  Way way_ = Way::kNone;
  Eigen::Matrix3d force_from_device_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d torque_from_device_ = Eigen::Matrix3d::Identity();
  double force_sign_ = 1;
  double full_scale_ = 0;  // N at the end of fields without newtons
  DeviceLimits limits_;
  std::vector<Axis> axes_;
  Layout force_;
  Field block_index_{};            // of Set Constant Force
  double effect_s_ = 0;            // that an effect lasts; 0: for ever
  std::int64_t effect_ticks_ = 0;  // the same in units of its Duration
  double force_timeout_s_ = 0;     // of the profile
  std::vector<std::vector<std::uint8_t>> renewals_;
  std::size_t max_bytes_ = 0;
  std::array<Control, 4> controls_{};
  Layout control_;
  ReportDescriptor descriptor_;  // for start()
};

}  // namespace stylet::haptic::hid
