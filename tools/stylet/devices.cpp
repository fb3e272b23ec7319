// `stylet devices`: what is plugged in, what each can do, and why one is not usable.
#include "engine/files/json_reader.h"
#include "engine/readers/calibration_file.h"
#include "engine/readers/device_profile_file.h"
#include "haptic/hid/hid_devices.h"
#include "haptic/hid/hid_transport.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/device_listing.h"
#include "tools/stylet/device_session.h"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace stylet::tools {

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

nlohmann::json describe_plugged_in(const std::vector<hid::DeviceProfile>& profiles) {
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
  return list;
}

struct DevicesOptions {
  bool json = false;
  bool fields = false;
  std::string descriptor;
  std::string id;
  bool calibrate = false;
  double still_s = 1;
  std::string record;
  double seconds = 0;  // 0: until Ctrl-C
  std::string device;
};

void run(const DevicesOptions& options) {
  if (options.calibrate) return calibrate_device(parse_hid_id(options.device), options.still_s);
  if (!options.record.empty()) return record_device(parse_hid_id(options.device), options.seconds, options.record);
  if (!options.device.empty()) {
    throw files::ContentError("devices " + options.device + ": say what to do with it, --calibrate or --record FILE");
  }
  const auto profiles = readers::load_device_profiles();
  nlohmann::json list = nlohmann::json::array();
  if (options.descriptor.empty()) {
    list = describe_plugged_in(profiles);
  } else {
    ListedDevice device{.path = options.descriptor};
    const HidChoice id = parse_hid_id(options.id);
    device.identity.vendor_id = id.vendor_id;
    device.identity.product_id = id.product_id;
    const std::vector<std::uint8_t> bytes = read_descriptor_file(options.descriptor);
    hid::ReportDescriptor parsed;
    try {
      parsed = hid::parse_report_descriptor(bytes);
    } catch (const hid::DescriptorError& error) {
      throw files::ContentError(fmt::format("{}: {}", options.descriptor, error.what()));
    }
    list.push_back(describe_device(device, bytes, profiles));
    if (options.fields) {
      list.back()["text"] = list.back()["text"].get<std::string>() + field_table(parsed);
    }
  }
  if (options.json) {
    for (nlohmann::json& device : list) device.erase("text");
    fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  for (const nlohmann::json& device : list) fmt::print("{}", device["text"].get<std::string>());
  if (list.empty()) fmt::print("no HID device is connected (there is no /dev/hidraw*)\n");
}

}  // namespace

void add_devices(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("devices", "List the HID devices: what each can do, or why it is not usable");
  auto options = std::make_shared<DevicesOptions>();
  command->add_flag("--json", options->json, "As JSON");
  auto* file = command->add_option("--descriptor", options->descriptor,
                                   "Describe a report descriptor from a file instead: bytes, or hexadecimal digits");
  command->add_option("--id", options->id, "VID:PID of that descriptor, to find its profile")->needs(file);
  command->add_flag("--fields", options->fields, "List every field of that descriptor")->needs(file);
  auto* calibrate = command->add_flag(
      "--calibrate", options->calibrate,
      "Measure a device with you: its rest place and corners, its dead zones; kept for `stylet train --device hid`");
  command->add_option("--hold", options->still_s, "How many seconds you hold still at each place")
      ->check(CLI::Range(0.05, 10.0))
      ->needs(calibrate)
      ->capture_default_str();
  auto* record = command
                     ->add_option("--record", options->record,
                                  "Motion file to write: a device's raw reports and the hand's poses; `stylet train "
                                  "--device recorded:FILE` plays it")
                     ->excludes(calibrate);
  command->add_option("--seconds", options->seconds, "How long to record; default: until Ctrl-C")
      ->check(CLI::PositiveNumber)
      ->needs(record);
  command->add_option("DEVICE", options->device,
                      "VID:PID of the device to calibrate or record; default: whichever can do most");
  command->footer(
      "To list them nothing is opened, so no permission is needed. A device says itself what its reports are (HID "
      "report\n"
      "descriptor); content/devices/ has profiles for what it does not say. haptic/README.md specifies the force\n"
      "stylus that Stylet is made for.\n\n"
      "  stylet devices --calibrate                   how the device lies on your desk, and how far you reach\n"
      "  stylet devices --record hand.json --seconds 10");
  command->callback([options] { run(*options); });
}

}  // namespace stylet::tools
