// What is plugged in: the HID devices that the program may open.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

/// One HID interface as the operating system lists it. Texts are UTF-8, empty where the device gives none.
struct HidDeviceSummary {
  std::string path;  ///< what to open, such as /dev/hidraw0
  std::uint16_t vendor_id = 0;
  std::uint16_t product_id = 0;
  std::uint16_t usage_page = 0;
  std::uint16_t usage = 0;
  std::string manufacturer;
  std::string product;
  std::string serial_number;
  std::string state{};  ///< what it needs before it can push, or is just now, one line; empty: it cannot be asked
};

/// All HID interfaces present, sorted by path; empty where there are none or the system has no HID.
/// Opens nothing, so it needs no permission on the devices. Not for running loops (system calls, allocation).
std::vector<HidDeviceSummary> list_hid_devices();

/// Version of the HID library that is loaded, such as "0.13.1".
std::string hid_library_version();

}  // namespace stylet::haptic::hid
