#include "engine/app/list_devices.h"

#include "engine/app/device_listing.h"
#include "engine/files/json_reader.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/device_profile_file.h"
#include "engine/sound/output.h"
#include "haptic/hid/hid_devices.h"
#include "haptic/hid/hid_transport.h"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string>
#include <vector>

namespace stylet::app {

namespace fs = std::filesystem;
namespace hid = haptic::hid;

namespace {

/// hidapi has one entry for every usage of a device.
std::vector<ListedDevice> plugged_in() {
  std::vector<ListedDevice> devices;
  for (const haptic::hid::HidDeviceSummary& summary : haptic::hid::list_hid_devices()) {
    if (!devices.empty() && devices.back().path == summary.path) continue;
    devices.push_back({.path = summary.path,
                       .identity = {summary.vendor_id, summary.product_id, summary.product},
                       .manufacturer = summary.manufacturer,
                       .serial_number = summary.serial_number,
                       .may_open = access(summary.path.c_str(), R_OK | W_OK) == 0});
  }
  return devices;
}

/// Of the endpoint that sends the reports: sysfs has it beside the HID device, on USB.
std::string report_interval(const std::string& path) {
  std::error_code error;
  const fs::path device = fs::canonical("/sys/class/hidraw" / fs::path(path).filename() / "device", error);
  if (error) return {};
  for (const auto& entry : fs::directory_iterator(device.parent_path(), error)) {
    if (!entry.path().filename().string().starts_with("ep_8")) continue;
    std::string interval;
    std::getline(std::ifstream(entry.path() / "interval"), interval);
    if (!interval.empty()) return interval;
  }
  return {};
}

/// Hexadecimal digits, with or without spaces, or the bytes themselves.
std::vector<std::uint8_t> read_descriptor_file(const fs::path& path) {
  const std::string text = files::read_file(path, 16 * hid::kMaxDescriptorBytes);
  const bool hex = std::ranges::all_of(text, [](unsigned char c) { return std::isxdigit(c) || std::isspace(c); });
  if (!hex) return {text.begin(), text.end()};
  std::string digits;
  std::ranges::copy_if(text, std::back_inserter(digits), [](unsigned char c) { return !std::isspace(c); });
  if (digits.size() % 2 != 0) throw files::ContentError(path.string() + ": an odd number of hexadecimal digits");
  std::vector<std::uint8_t> bytes(digits.size() / 2);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::from_chars(digits.data() + 2 * k, digits.data() + 2 * k + 2, bytes[k], 16);
  }
  return bytes;
}

/// Where it has one: the file, and what is wrong with it.
void add_calibration(const ListedDevice& device, nlohmann::json& described) {
  const readers::CalibratedDevice which{device.identity.vendor_id, device.identity.product_id, device.serial_number,
                                        device.identity.product};
  try {
    if (!readers::load_calibration(which)) return;
    const std::string file = readers::calibration_file(which).string();
    described["calibration"] = file;
    described["text"] = described["text"].get<std::string>() + fmt::format("  {:<11}{}\n", "calibrated", file);
  } catch (const files::ContentError& error) {
    described["calibration_problem"] = error.what();
    described["text"] =
        described["text"].get<std::string>() + fmt::format("  calibration not usable: {}\n", error.what());
  }
}

}  // namespace

nlohmann::json list_devices() {
  const auto profiles = readers::load_device_profiles();
  nlohmann::json list = nlohmann::json::array();
  for (ListedDevice& device : plugged_in()) {
    device.interval = report_interval(device.path);
    std::vector<std::uint8_t> bytes;
    try {
      bytes = hid::report_descriptor(device.path);
    } catch (const hid::HidError& error) {
      list.push_back({{"path", device.path},
                      {"usable", false},
                      {"reason", error.what()},
                      {"text", fmt::format("{}\n  not usable: {}\n", device.path, error.what())}});
      continue;
    }
    list.push_back(describe_device(device, bytes, profiles));
    add_calibration(device, list.back());
  }
  for (const NamedSource& named : named_sources()) {
    const hid::DeviceSource& source = named.source();
    const auto summaries = source.list();
    for (const hid::HidDeviceSummary& summary : summaries) {
      const ListedDevice device{.path = summary.path,
                                .identity = {summary.vendor_id, summary.product_id, summary.product},
                                .manufacturer = summary.manufacturer,
                                .serial_number = summary.serial_number,
                                .state = summary.state};
      list.push_back(describe_device(device, source.descriptor(device.path), profiles));
      add_calibration(device, list.back());
    }
    if (!summaries.empty()) continue;
    if (const std::string reason = source.complaint(); !reason.empty()) {
      list.push_back({{"path", named.name},
                      {"usable", false},
                      {"reason", reason},
                      {"text", fmt::format("{}\n  not usable: {}\n", named.name, reason)}});
    }
  }
  return list;
}

nlohmann::json describe_descriptor(const fs::path& file, const HidChoice& id, bool fields) {
  ListedDevice device{.path = file.string()};
  device.identity.vendor_id = id.vendor_id;
  device.identity.product_id = id.product_id;
  const std::vector<std::uint8_t> bytes = read_descriptor_file(file);
  hid::ReportDescriptor parsed;
  try {
    parsed = hid::parse_report_descriptor(bytes);
  } catch (const hid::DescriptorError& error) {
    throw files::ContentError(fmt::format("{}: {}", file.string(), error.what()));
  }
  nlohmann::json described = describe_device(device, bytes, readers::load_device_profiles());
  if (fields) described["text"] = described["text"].get<std::string>() + field_table(parsed);
  return described;
}

std::string sound_device() {
  sound::quieten_libraries();
  const auto output = sound::Output::open();
  return output ? output->name() : "";
}

}  // namespace stylet::app
