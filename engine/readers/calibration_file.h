// Calibrations of devices, one file each in the user's configuration (content/README.md, "stylet-calibration").
#pragma once

#include "engine/files/json_reader.h"
#include "haptic/hid/calibration.h"

#include <filesystem>
#include <optional>
#include <string>

namespace stylet::readers {

/// Which device a calibration is of: two of one kind lie differently.
struct CalibratedDevice {
  std::uint16_t vendor_id = 0;
  std::uint16_t product_id = 0;
  std::string serial_number{};  ///< UTF-8; empty: it has none
  std::string product{};        ///< its name, for people
};

/// Its keys.
const files::FileFormat& calibration_format();

/// Problems go to `file`; what comes out is in range even then.
haptic::hid::Calibration read_calibration(files::JsonFile& file, CalibratedDevice* device = nullptr);

/// devices/VID-PID-SERIAL.json in $XDG_CONFIG_HOME/stylet, else in ~/.config/stylet; empty where neither is known.
std::filesystem::path calibration_file(const CalibratedDevice& device);

/// Nothing where there is no file. @throws ContentError  it is wrong, or another device's
std::optional<haptic::hid::Calibration> load_calibration(const CalibratedDevice& device);

/// Whole or not at all. @return the file @throws ContentError  it cannot be written
std::filesystem::path save_calibration(const CalibratedDevice& device, const haptic::hid::Calibration& calibration);

}  // namespace stylet::readers
