// What the reports of a HID device are to a needle: which field is which axis, and raw reports made into readings.
#pragma once

#include "haptic/hid/device_profile.h"
#include "haptic/hid/report_field.h"

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

/// Bits of HidReading::carries.
enum Carried : std::uint32_t {
  kPosition = 0x001,
  kOrientation = 0x002,
  kVelocity = 0x004,
  kAngularVelocity = 0x008,
  kButtons = 0x010,
  kScanTime = 0x020,
  kPressure = 0x040,
  kTilt = 0x080,
  kTwist = 0x100,
  kPresence = 0x200,   ///< in_range
  kActuators = 0x400,  ///< actuators_enabled, safety_switch, actuator_power
};

/// Buttons of styluses and pens; button n of other devices is bit n - 1.
enum StylusButton : std::uint32_t {
  kBarrelButton = 1,
  kSecondaryBarrelButton = 2,
  kTip = 4,
  kEraserButton = 8,
};

/// What is known of a device after a report: a report changes what it carries and leaves the rest. Device frame, SI.
struct HidReading {
  std::uint32_t carries = 0;  ///< what the last report carried, of Carried

  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< of the needle hub, of pens of their tip, m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< device frame from needle frame
  /// Of devices whose axes spring back: m/s and rad/s. They send zeros when let go, and then nothing.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();

  std::uint32_t buttons = 0;
  std::uint32_t scan_time = 0;                     ///< ticks of StylusMap::scan_tick_s()
  bool in_range = false;                           ///< false: the pose means nothing
  double pressure = 0;                             ///< of the tip, 0 to 1
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  ///< of the upper end to the right and towards the trainee, rad
  double twist = 0;                                ///< clockwise seen from the upper end, rad
  double azimuth = 0;   ///< of the upper end, counter-clockwise from the right, seen from above, rad
  double altitude = 0;  ///< above the tablet, rad

  bool actuators_enabled = false;
  bool safety_switch = false;
  bool actuator_power = false;

  /// X Y Z Rx Ry Rz as the reports have them, before the profile: m and rad, or parts of the full deflection.
  std::array<double, 6> axes{};
};

/// What became of a report.
enum class Decoded : std::uint8_t {
  kReading,
  kNothing,     ///< sound, and without anything of use
  kUndeclared,  ///< an id that the descriptor does not have
  kTruncated,
  kOversized,
  kOutOfRange,  ///< an axis of a pose beyond its logical range
};
inline constexpr std::size_t kDecodedCount = 6;

enum class Quantity : std::uint8_t {
  kAxis,         ///< index: X Y Z Rx Ry Rz
  kButton,       ///< index: bit
  kButtonArray,  ///< index: number of the button that the logical minimum selects
  kPressure,
  kXTilt,
  kYTilt,
  kAzimuth,
  kAltitude,
  kTwist,
  kInRange,
  kScanTime,
  kActuatorsEnabled,
  kSafetySwitch,
  kActuatorPower,
};

/// One field that counts.
struct InputSlot {
  Field field{};
  Quantity quantity = Quantity::kAxis;
  std::uint32_t index = 0;
  double scale = 1;  ///< value = logical * scale + offset, as in HidReading::axes
  double offset = 0;
};

/// Immutable once made: any thread may read it.
class StylusMap {
public:
  /// Not for running loops.
  StylusMap(const ReportDescriptor& descriptor, const DeviceProfile& profile);

  DeviceKind kind() const { return kind_; }
  bool usable() const { return kind_ != DeviceKind::kUnusable; }
  /// Why it is not usable, and what to do: one line.
  const std::string& reason() const { return reason_; }
  /// Whether its motion gives velocities only.
  bool rate_only() const { return kind_ == DeviceKind::kSpaceMouse; }

  const std::vector<InputSlot>& inputs() const { return slots_; }
  bool has(Quantity quantity, std::uint32_t index = 0) const;
  /// All that it has, a bit each.
  std::uint32_t buttons() const;
  /// The first of the button page behind the trigger that is not in `taken`, counted from 1; 0: there is none. A pen
  /// has none: its buttons draw back and take hold anew.
  int free_button(std::uint32_t taken) const;
  /// s a tick of HidReading::scan_time; 0: the device has none.
  double scan_tick_s() const { return scan_tick_s_; }
  /// Ticks after which it wraps; 0: it has none.
  std::uint64_t scan_modulus() const { return scan_modulus_; }
  /// Longest input report with its id.
  std::size_t max_input_bytes() const { return max_input_bytes_; }

  /// Takes in a report as hidapi reads it: with its id first where the reports are numbered. Anything but kReading
  /// leaves the reading as it was.
  /// @realtime no allocation, no exception; time proportional to the fields of the report
  Decoded decode(std::span<const std::uint8_t> report, HidReading& reading) const noexcept;

private:
  struct InputReport {
    bool declared = false;
    std::uint32_t bytes = 0;
    std::uint32_t first = 0;  // of slots_
    std::uint32_t count = 0;
  };

  bool take(const InputSlot& slot, std::span<const std::uint8_t> data, HidReading& next,
            bool& present) const noexcept;
  void pose(HidReading& next) const noexcept;

  DeviceKind kind_ = DeviceKind::kUnusable;
  std::string reason_;
  DeviceProfile profile_;
  bool numbered_ = false;
  bool says_in_range_ = false;
  bool by_altitude_ = false;
  double scan_tick_s_ = 0;
  std::uint64_t scan_modulus_ = 0;
  std::size_t max_input_bytes_ = 0;
  std::array<InputReport, 256> reports_{};  // by id
  std::vector<InputSlot> slots_;            // by report id
};

/// What a descriptor makes of a device without a profile, and why it is of no use.
DeviceKind kind_of(const ReportDescriptor& descriptor, std::string* reason = nullptr);

}  // namespace stylet::haptic::hid
