// The usages that Stylet knows (HID Usage Tables 1.5; PID: Device Class Definition for Physical Interface
// Devices 1.0).
#pragma once

#include "haptic/hid/report_descriptor.h"

#include <string>

namespace stylet::haptic::hid::usages {

// Generic Desktop.
inline constexpr Usage kPointer = usage(0x01, 0x01);
inline constexpr Usage kMouse = usage(0x01, 0x02);
inline constexpr Usage kJoystick = usage(0x01, 0x04);
inline constexpr Usage kGamePad = usage(0x01, 0x05);
inline constexpr Usage kKeyboard = usage(0x01, 0x06);
inline constexpr Usage kKeypad = usage(0x01, 0x07);
inline constexpr Usage kMultiAxisController = usage(0x01, 0x08);
inline constexpr Usage kX = usage(0x01, 0x30);
inline constexpr Usage kY = usage(0x01, 0x31);
inline constexpr Usage kZ = usage(0x01, 0x32);
inline constexpr Usage kRx = usage(0x01, 0x33);
inline constexpr Usage kRy = usage(0x01, 0x34);
inline constexpr Usage kRz = usage(0x01, 0x35);

inline constexpr std::uint32_t kButtonPage = 0x09;

// Digitizers.
inline constexpr Usage kDigitizer = usage(0x0D, 0x01);
inline constexpr Usage kPen = usage(0x0D, 0x02);
inline constexpr Usage kTouchScreen = usage(0x0D, 0x04);
inline constexpr Usage kTouchPad = usage(0x0D, 0x05);
inline constexpr Usage kStylus = usage(0x0D, 0x20);
inline constexpr Usage kPuck = usage(0x0D, 0x21);
inline constexpr Usage kFinger = usage(0x0D, 0x22);
inline constexpr Usage kTipPressure = usage(0x0D, 0x30);
inline constexpr Usage kInRange = usage(0x0D, 0x32);
inline constexpr Usage kXTilt = usage(0x0D, 0x3D);
inline constexpr Usage kYTilt = usage(0x0D, 0x3E);
inline constexpr Usage kAzimuth = usage(0x0D, 0x3F);
inline constexpr Usage kAltitude = usage(0x0D, 0x40);
inline constexpr Usage kTwist = usage(0x0D, 0x41);
inline constexpr Usage kTipSwitch = usage(0x0D, 0x42);
inline constexpr Usage kBarrelSwitch = usage(0x0D, 0x44);
inline constexpr Usage kEraser = usage(0x0D, 0x45);
inline constexpr Usage kScanTime = usage(0x0D, 0x56);
inline constexpr Usage kSecondaryBarrelSwitch = usage(0x0D, 0x5A);

// Physical Interface Devices (PID).
inline constexpr std::uint32_t kPidPage = 0x0F;
inline constexpr Usage kSetEffect = usage(0x0F, 0x21);
inline constexpr Usage kEffectBlockIndex = usage(0x0F, 0x22);
inline constexpr Usage kEffectType = usage(0x0F, 0x25);
inline constexpr Usage kConstantForce = usage(0x0F, 0x26);
inline constexpr Usage kDuration = usage(0x0F, 0x50);
inline constexpr Usage kEffectGain = usage(0x0F, 0x52);
inline constexpr Usage kTriggerButton = usage(0x0F, 0x53);
inline constexpr Usage kAxesEnable = usage(0x0F, 0x55);
inline constexpr Usage kDirectionEnable = usage(0x0F, 0x56);
inline constexpr Usage kDirection = usage(0x0F, 0x57);
inline constexpr Usage kDownloadForceSample = usage(0x0F, 0x66);
inline constexpr Usage kMagnitude = usage(0x0F, 0x70);
inline constexpr Usage kSetConstantForce = usage(0x0F, 0x73);
inline constexpr Usage kEffectOperationReport = usage(0x0F, 0x77);
inline constexpr Usage kEffectOperation = usage(0x0F, 0x78);
inline constexpr Usage kEffectStart = usage(0x0F, 0x79);
inline constexpr Usage kEffectStop = usage(0x0F, 0x7B);
inline constexpr Usage kLoopCount = usage(0x0F, 0x7C);
inline constexpr Usage kDeviceGainReport = usage(0x0F, 0x7D);
inline constexpr Usage kDeviceGain = usage(0x0F, 0x7E);
inline constexpr Usage kBlockLoad = usage(0x0F, 0x89);
inline constexpr Usage kBlockLoadStatus = usage(0x0F, 0x8B);
inline constexpr Usage kBlockLoadSuccess = usage(0x0F, 0x8C);
inline constexpr Usage kPidState = usage(0x0F, 0x92);
inline constexpr Usage kDeviceControlReport = usage(0x0F, 0x95);
inline constexpr Usage kDeviceControl = usage(0x0F, 0x96);
inline constexpr Usage kEnableActuators = usage(0x0F, 0x97);
inline constexpr Usage kDisableActuators = usage(0x0F, 0x98);
inline constexpr Usage kStopAllEffects = usage(0x0F, 0x99);
inline constexpr Usage kDeviceReset = usage(0x0F, 0x9A);
inline constexpr Usage kActuatorsEnabled = usage(0x0F, 0xA0);
inline constexpr Usage kSafetySwitch = usage(0x0F, 0xA4);
inline constexpr Usage kActuatorPower = usage(0x0F, 0xA6);
inline constexpr Usage kCreateNewEffect = usage(0x0F, 0xAB);

/// Pages 0xFF00 and above belong to vendors.
constexpr bool is_vendor(Usage u) {
  return u >> 16 >= 0xFF00;
}

}  // namespace stylet::haptic::hid::usages
