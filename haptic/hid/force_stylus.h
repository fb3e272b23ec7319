// The force stylus that Stylet specifies: its report descriptor and its reports, byte by byte; haptic/README.md tells
// a maker the rest. Any device with such usages is taken, whatever its bytes: this is the one that tests and mocks
// use.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace stylet::haptic::hid {

inline constexpr std::uint8_t kPoseReport = 1;     ///< input, every millisecond
inline constexpr std::uint8_t kForceReport = 2;    ///< output, at least every kForceTimeout
inline constexpr std::uint8_t kControlReport = 3;  ///< output
inline constexpr std::uint8_t kGainReport = 4;     ///< feature

// With the id.
inline constexpr std::size_t kPoseReportBytes = 28;
inline constexpr std::size_t kForceReportBytes = 7;
inline constexpr std::size_t kControlReportBytes = 2;
inline constexpr std::size_t kGainReportBytes = 2;

inline constexpr double kForceStylusMaxForce = 3.3;        ///< N, an axis: the physical range of report 2
inline constexpr double kForceStylusForceTimeout = 0.020;  ///< s without report 2 until it drops the force by itself
inline constexpr std::uint16_t kScanTicksPerReport = 10;   ///< of 100 us

/// What the value of report 3 asks for.
enum class ForceStylusControl : std::uint8_t {
  kEnableActuators = 1,
  kDisableActuators = 2,
  kStopAll = 3,
  kReset = 4,
};

// clang-format off
inline constexpr std::array<std::uint8_t, 235> kForceStylusDescriptor = {
    0x05, 0x01,                    // Usage Page (Generic Desktop)
    0x09, 0x08,                    // Usage (Multi-axis Controller)
    0xA1, 0x01,                    // Collection (Application)
    0x85, 0x01,                    //   Report ID (1)
    0x09, 0x01,                    //   Usage (Pointer)
    0xA1, 0x00,                    //   Collection (Physical)
    0x17, 0x80, 0x69, 0x67, 0xFF,  //     Logical Minimum (-10000000)
    0x27, 0x80, 0x96, 0x98, 0x00,  //     Logical Maximum (10000000)
    0x37, 0x80, 0x69, 0x67, 0xFF,  //     Physical Minimum (-10000000)
    0x47, 0x80, 0x96, 0x98, 0x00,  //     Physical Maximum (10000000)
    0x65, 0x11,                    //     Unit (cm)
    0x55, 0x0B,                    //     Unit Exponent (-5): 0.1 um
    0x09, 0x30,                    //     Usage (X)
    0x09, 0x31,                    //     Usage (Y)
    0x09, 0x32,                    //     Usage (Z)
    0x75, 0x20,                    //     Report Size (32)
    0x95, 0x03,                    //     Report Count (3)
    0x81, 0x02,                    //     Input (Data, Variable, Absolute)
    0x17, 0x27, 0x10, 0xD0, 0xFF,  //     Logical Minimum (-3141593)
    0x27, 0xD9, 0xEF, 0x2F, 0x00,  //     Logical Maximum (3141593)
    0x37, 0x27, 0x10, 0xD0, 0xFF,  //     Physical Minimum (-3141593)
    0x47, 0xD9, 0xEF, 0x2F, 0x00,  //     Physical Maximum (3141593)
    0x65, 0x12,                    //     Unit (rad)
    0x55, 0x0A,                    //     Unit Exponent (-6): 1 urad
    0x09, 0x33,                    //     Usage (Rx)
    0x09, 0x34,                    //     Usage (Ry)
    0x09, 0x35,                    //     Usage (Rz)
    0x81, 0x02,                    //     Input (Data, Variable, Absolute)
    0xC0,                          //   End Collection
    0x05, 0x0D,                    //   Usage Page (Digitizers)
    0x09, 0x56,                    //   Usage (Scan Time)
    0x15, 0x00,                    //   Logical Minimum (0)
    0x27, 0xFF, 0xFF, 0x00, 0x00,  //   Logical Maximum (65535)
    0x35, 0x00,                    //   Physical Minimum (0)
    0x47, 0xFF, 0xFF, 0x00, 0x00,  //   Physical Maximum (65535)
    0x66, 0x01, 0x10,              //   Unit (s)
    0x55, 0x0C,                    //   Unit Exponent (-4): 100 us
    0x75, 0x10,                    //   Report Size (16)
    0x95, 0x01,                    //   Report Count (1)
    0x81, 0x02,                    //   Input (Data, Variable, Absolute)
    0x25, 0x01,                    //   Logical Maximum (1)
    0x45, 0x00,                    //   Physical Maximum (0)
    0x65, 0x00,                    //   Unit (none)
    0x55, 0x00,                    //   Unit Exponent (0)
    0x09, 0x44,                    //   Usage (Barrel Switch)
    0x09, 0x5A,                    //   Usage (Secondary Barrel Switch)
    0x09, 0x32,                    //   Usage (In Range)
    0x75, 0x01,                    //   Report Size (1)
    0x95, 0x03,                    //   Report Count (3)
    0x81, 0x02,                    //   Input (Data, Variable, Absolute)
    0x05, 0x0F,                    //   Usage Page (Physical Interface Device)
    0x09, 0x92,                    //   Usage (PID State Report)
    0xA1, 0x02,                    //   Collection (Logical)
    0x09, 0xA0,                    //     Usage (Actuators Enabled)
    0x09, 0xA4,                    //     Usage (Safety Switch)
    0x09, 0xA6,                    //     Usage (Actuator Power)
    0x81, 0x02,                    //     Input (Data, Variable, Absolute)
    0xC0,                          //   End Collection
    0x95, 0x02,                    //   Report Count (2)
    0x81, 0x03,                    //   Input (Constant)
    0x09, 0x66,                    //   Usage (Download Force Sample)
    0xA1, 0x02,                    //   Collection (Logical)
    0x85, 0x02,                    //     Report ID (2)
    0x05, 0x01,                    //     Usage Page (Generic Desktop)
    0x16, 0x01, 0x80,              //     Logical Minimum (-32767)
    0x26, 0xFF, 0x7F,              //     Logical Maximum (32767)
    0x36, 0x1C, 0xF3,              //     Physical Minimum (-3300)
    0x46, 0xE4, 0x0C,              //     Physical Maximum (3300)
    0x66, 0x11, 0xE1,              //     Unit (g cm s^-2)
    0x55, 0x02,                    //     Unit Exponent (2): mN
    0x09, 0x30,                    //     Usage (X)
    0x09, 0x31,                    //     Usage (Y)
    0x09, 0x32,                    //     Usage (Z)
    0x75, 0x10,                    //     Report Size (16)
    0x95, 0x03,                    //     Report Count (3)
    0x91, 0x02,                    //     Output (Data, Variable, Absolute)
    0x35, 0x00,                    //     Physical Minimum (0)
    0x45, 0x00,                    //     Physical Maximum (0)
    0x65, 0x00,                    //     Unit (none)
    0x55, 0x00,                    //     Unit Exponent (0)
    0xC0,                          //   End Collection
    0x05, 0x0F,                    //   Usage Page (Physical Interface Device)
    0x09, 0x96,                    //   Usage (PID Device Control)
    0xA1, 0x02,                    //   Collection (Logical)
    0x85, 0x03,                    //     Report ID (3)
    0x19, 0x97,                    //     Usage Minimum (DC Enable Actuators)
    0x29, 0x9A,                    //     Usage Maximum (DC Device Reset)
    0x15, 0x01,                    //     Logical Minimum (1)
    0x25, 0x04,                    //     Logical Maximum (4)
    0x75, 0x08,                    //     Report Size (8)
    0x95, 0x01,                    //     Report Count (1)
    0x91, 0x00,                    //     Output (Data, Array)
    0xC0,                          //   End Collection
    0x09, 0x7D,                    //   Usage (Device Gain Report)
    0xA1, 0x02,                    //   Collection (Logical)
    0x85, 0x04,                    //     Report ID (4)
    0x09, 0x7E,                    //     Usage (Device Gain)
    0x15, 0x00,                    //     Logical Minimum (0)
    0x26, 0xFF, 0x00,              //     Logical Maximum (255)
    0xB1, 0x02,                    //     Feature (Data, Variable, Absolute)
    0xC0,                          //   End Collection
    0xC0,                          // End Collection
};
// clang-format on

/// What the device says, in its frame.
struct ForceStylusPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();         ///< m
  Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();  ///< axis times angle, rad, at most pi long
  std::uint16_t scan_time = 0;                                ///< 100 us ticks
  bool barrel = false;
  bool secondary_barrel = false;
  bool in_range = true;  ///< false: the pose means nothing
  bool actuators_enabled = false;
  bool safety_switch = false;   ///< closed: it may move
  bool actuator_power = false;  ///< the motors have their supply
};

/// Report 1 as the device makes it; values beyond their range stop at its end.
std::array<std::uint8_t, kPoseReportBytes> pack_pose(const ForceStylusPose& pose);

/// Report 2 as the device reads it: N. Nothing: not a whole report 2, or a value outside the logical range.
/// @param max_force_n  an axis: its physical range
std::optional<Eigen::Vector3d> unpack_force(std::span<const std::uint8_t> report,
                                            double max_force_n = kForceStylusMaxForce);

}  // namespace stylet::haptic::hid
