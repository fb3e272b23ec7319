// A HID device in words: what it is, what it can do for a needle, or why it can do nothing.
#pragma once

#include "haptic/hid/device_profile.h"
#include "haptic/hid/report_descriptor.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace stylet::app {

/// Where a device is and what it calls itself; of a descriptor from a file only the ids may be known.
struct ListedDevice {
  std::string path;
  haptic::hid::DeviceIdentity identity{};
  std::string manufacturer{};
  std::string serial_number{};
  std::string interval{};  ///< between reports, as the bus has it, such as "1ms"; empty: unknown
  bool may_open = true;    ///< false: for want of permission
  std::string state{};     ///< HidDeviceSummary::state
};

/// As `stylet devices --json` prints it; "text" holds the lines for people.
/// @param descriptor  bytes; where they are wrong that is the reason why the device is not usable
nlohmann::json describe_device(const ListedDevice& device, std::span<const std::uint8_t> descriptor,
                               const std::vector<haptic::hid::DeviceProfile>& profiles);

/// Every field of a descriptor, one a line.
std::string field_table(const haptic::hid::ReportDescriptor& descriptor);

}  // namespace stylet::app
