#include "haptic/hid/hid_devices.h"

#include <hidapi.h>

#include <algorithm>
#include <memory>

namespace stylet::haptic::hid {
namespace {

/// hidapi gives wchar_t texts (UTF-32 on Linux), any pointer may be null.
std::string utf8(const wchar_t* text) {
  std::string out;
  for (; text != nullptr && *text != 0; ++text) {
    const auto c = static_cast<std::uint32_t>(*text);  // NOLINT(bugprone-signed-char-misuse): 32 bits
    const auto put = [&out](std::uint32_t byte) { out.push_back(static_cast<char>(byte)); };
    if (c < 0x80) {
      put(c);
    } else if (c < 0x800) {
      put(0xC0 | c >> 6), put(0x80 | (c & 0x3F));
    } else if (c < 0x10000) {
      put(0xE0 | c >> 12), put(0x80 | (c >> 6 & 0x3F)), put(0x80 | (c & 0x3F));
    } else if (c < 0x110000) {
      put(0xF0 | c >> 18), put(0x80 | (c >> 12 & 0x3F)), put(0x80 | (c >> 6 & 0x3F)), put(0x80 | (c & 0x3F));
    }
  }
  return out;
}

}  // namespace

std::vector<HidDeviceSummary> list_hid_devices() {
  const std::unique_ptr<hid_device_info, decltype(&hid_free_enumeration)> list(hid_enumerate(0, 0),
                                                                               hid_free_enumeration);
  std::vector<HidDeviceSummary> devices;
  for (const hid_device_info* d = list.get(); d != nullptr; d = d->next) {
    devices.push_back({.path = d->path != nullptr ? d->path : "",
                       .vendor_id = d->vendor_id,
                       .product_id = d->product_id,
                       .usage_page = d->usage_page,
                       .usage = d->usage,
                       .manufacturer = utf8(d->manufacturer_string),
                       .product = utf8(d->product_string),
                       .serial_number = utf8(d->serial_number)});
  }
  std::sort(devices.begin(), devices.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return devices;
}

std::string hid_library_version() {
  return hid_version_str();
}

}  // namespace stylet::haptic::hid
