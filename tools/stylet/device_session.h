// `stylet devices --calibrate` and `--record`: a device by itself, without a patient.
#pragma once

#include "tools/stylet/hid_device.h"

#include <filesystem>

namespace stylet::tools {

/// Guides the user through the places and writes the calibration file.
/// @param still_s  that the hand holds still at each
/// @throws files::ContentError, haptic::hid::HidError, haptic::hid::CalibrationError
void calibrate_device(const HidChoice& choice, double still_s);

/// Writes the device's reports and the hand's poses as a motion file.
/// @param seconds  0: until Ctrl-C
/// @throws files::ContentError, haptic::hid::HidError
void record_device(const HidChoice& choice, double seconds, const std::filesystem::path& file);

}  // namespace stylet::tools
