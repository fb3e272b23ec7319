// A device as hidapi gives it, found by what it is.
#pragma once

#include <hidapi.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

namespace stylet::kernel_test {

using HidapiFile = std::unique_ptr<hid_device, decltype(&hid_close)>;

struct HidapiEntry {
  std::string path;
  std::wstring manufacturer, product, serial;
  int interface_number = 0;
};

/// The first entry of a device, nothing where it is not there. A new list is made: without udevd libusb hears of
/// nothing that is plugged in later.
inline std::optional<HidapiEntry> find(std::uint16_t vendor, std::uint16_t product) {
  hid_exit();
  const std::unique_ptr<hid_device_info, decltype(&hid_free_enumeration)> list(hid_enumerate(vendor, product),
                                                                               hid_free_enumeration);
  if (list == nullptr) {
    return {};
  }
  const auto text = [](const wchar_t* t) { return std::wstring(t != nullptr ? t : L""); };
  return HidapiEntry{.path = list->path,
                     .manufacturer = text(list->manufacturer_string),
                     .product = text(list->product_string),
                     .serial = text(list->serial_number),
                     .interface_number = list->interface_number};
}

/// Waits until the device is there (or, `present` false, until it is not).
inline std::optional<HidapiEntry> wait_for(std::uint16_t vendor, std::uint16_t product, bool present = true) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  auto entry = find(vendor, product);
  while (entry.has_value() != present && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    entry = find(vendor, product);
  }
  return entry;
}

inline HidapiFile open(const HidapiEntry& entry) {
  return {hid_open_path(entry.path.c_str()), hid_close};
}

}  // namespace stylet::kernel_test
