// A device by itself, without a patient: calibrated with its user, recorded, felt.
#pragma once

#include "engine/app/hid_device.h"
#include "engine/app/observer.h"

#include <filesystem>

namespace stylet::app {

/// Guides the user by notes through the places and writes the calibration file.
/// @param still_s  that the hand holds still at each
/// @throws files::ContentError, haptic::hid::HidError, haptic::hid::CalibrationError
void calibrate_device(const HidChoice& choice, double still_s, Observer& observer);

/// Writes the device's reports and the hand's poses as a motion file.
/// @param seconds  0: until the observer asks for the end
/// @throws files::ContentError, haptic::hid::HidError
void record_device(const HidChoice& choice, double seconds, const std::filesystem::path& file, Observer& observer);

/// A spring, a wall, friction and a skin that gives way, one after the other, each with what should be felt and what
/// was asked of the device. All limits of a session act.
/// @param each_s  that each lasts
/// @throws files::ContentError, haptic::hid::HidError
void feel_device(const HidChoice& choice, double each_s, Observer& observer);

}  // namespace stylet::app
