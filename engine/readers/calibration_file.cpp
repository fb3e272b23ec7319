#include "engine/readers/calibration_file.h"

#include "engine/readers/device_profile_file.h"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <fstream>

namespace stylet::readers {

namespace fs = std::filesystem;
using haptic::hid::Calibration;

namespace {

constexpr files::JsonLimits kLimits{.bytes = 64u << 10, .depth = 8};
constexpr const char* kAnew = "; run `stylet devices --calibrate` to make it anew";

std::array<double, 6> six(files::JsonObject& object, const char* key, files::Range range) {
  if (!object.has(key)) object.problem(key, "is missing; give six numbers, of X Y Z Rx Ry Rz");
  std::array<double, 6> values{};
  const std::vector<double> numbers = object.numbers(key, values.size(), range, std::vector<double>(values.size()));
  std::copy_n(numbers.begin(), std::min(numbers.size(), values.size()), values.begin());
  return values;
}

std::string hexadecimal(std::uint16_t id) {
  return fmt::format("{:04x}", id);
}

/// What a file name may hold of a serial number.
std::string plain(const std::string& text) {
  std::string name = text;
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; }, '_');
  return name.substr(0, 64);
}

nlohmann::json to_json(const CalibratedDevice& device, const Calibration& calibration) {
  const Eigen::Quaterniond& q = calibration.user_from_device;
  nlohmann::json out;
  out["format"] = "stylet-calibration";
  out["version"] = 1;
  out["vendor_id"] = hexadecimal(device.vendor_id);
  out["product_id"] = hexadecimal(device.product_id);
  out["serial_number"] = device.serial_number;
  out["product"] = device.product;
  if (calibration.rest) {
    const Eigen::Vector3d rest_mm = 1e3 * *calibration.rest;
    out["rest_mm"] = std::vector<double>(rest_mm.begin(), rest_mm.end());
  }
  out["user_from_device"] = std::vector<double>{q.w(), q.x(), q.y(), q.z()};
  out["scale"] = calibration.scale;
  if (calibration.centre && calibration.dead_zone) {
    out["deflection"]["centre"] = *calibration.centre;
    out["deflection"]["dead_zone"] = *calibration.dead_zone;
  }
  return out;
}

}  // namespace

Calibration read_calibration(files::JsonFile& file, CalibratedDevice* device) {
  files::JsonObject root = file.root("stylet-calibration", 1);
  CalibratedDevice found;
  found.vendor_id = read_hex_id(root, "vendor_id", root.text("vendor_id")).value_or(0);
  found.product_id = read_hex_id(root, "product_id", root.text("product_id")).value_or(0);
  found.serial_number = root.text("serial_number");
  found.product = root.text("product", "");
  Calibration calibration;
  if (root.has("rest_mm")) calibration.rest = 1e-3 * root.vector3("rest_mm", {-1e4, 1e4});
  calibration.user_from_device = root.quaternion("user_from_device", Eigen::Quaterniond::Identity());
  calibration.scale = root.number("scale", {0.1, 10}, 1);
  if (auto deflection = root.object("deflection", false)) {
    calibration.centre = six(*deflection, "centre", {-0.25, 0.25});
    calibration.dead_zone = six(*deflection, "dead_zone", {0, 0.5});
    deflection->finish();
  }
  root.finish();
  if (device != nullptr) *device = found;
  return calibration;
}

fs::path calibration_file(const CalibratedDevice& device) {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (config != nullptr && fs::path(config).is_absolute()) {
    folder = config;
  } else if (home != nullptr && fs::path(home).is_absolute()) {
    folder = fs::path(home) / ".config";
  } else {
    return {};
  }
  return folder / "stylet" / "devices" /
         fmt::format("{:04x}-{:04x}{}{}.json", device.vendor_id, device.product_id,
                     device.serial_number.empty() ? "" : "-", plain(device.serial_number));
}

std::optional<Calibration> load_calibration(const CalibratedDevice& device) {
  const fs::path path = calibration_file(device);
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) return {};
  try {
    files::JsonFile file(path, kLimits);
    CalibratedDevice of;
    Calibration calibration = read_calibration(file, &of);
    file.throw_problems();
    if (of.vendor_id != device.vendor_id || of.product_id != device.product_id ||
        of.serial_number != device.serial_number) {
      throw files::ContentError(fmt::format("{}: is of another device ({:04x}:{:04x}, serial number \"{}\")",
                                            path.string(), of.vendor_id, of.product_id, of.serial_number));
    }
    return calibration;
  } catch (const files::ContentError& problem) {
    throw files::ContentError(fmt::format("{}{}", problem.what(), kAnew));
  }
}

fs::path save_calibration(const CalibratedDevice& device, const Calibration& calibration) {
  const fs::path path = calibration_file(device);
  if (path.empty()) {
    throw files::ContentError(
        "the calibration has no place: neither XDG_CONFIG_HOME nor HOME is an absolute path; set one");
  }
  const fs::path part = fmt::format("{}.{}.part", path.string(), ::getpid());
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  bool written = false;
  if (!error) {
    std::ofstream out(part, std::ios::binary);
    out << to_json(device, calibration).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    written = static_cast<bool>(out.flush());
  }
  if (written) fs::rename(part, path, error);
  if (!written || error) {
    std::error_code ignored;
    fs::remove(part, ignored);
    throw files::ContentError(fmt::format("{}: cannot be written ({}); check folder and space", path.string(),
                                          error ? error.message() : "no space, or no permission"));
  }
  return path;
}

}  // namespace stylet::readers
