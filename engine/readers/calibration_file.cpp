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
namespace key = files::key;
using files::Key;
using haptic::hid::Calibration;

namespace {

constexpr files::JsonLimits kLimits{.bytes = 64u << 10, .depth = 8};
constexpr const char* kAnew = "; run `stylet devices --calibrate` to make it anew";

constexpr struct {
  Key centre = key::numbers("centre", 6, "", {-0.25, 0.25}, "what they show at rest");
  Key dead_zone = key::numbers("dead_zone", 6, "", {0, 0.5},
                               "what about it is no motion: 1.5 times what was seen in a second, at least 0.02");
} kDeflection;

constexpr struct {
  Key vendor_id = key::text("vendor_id", "four hexadecimal digits").schema(kHexId);
  Key product_id = key::text("product_id", "four hexadecimal digits").schema(kHexId);
  Key serial_number = key::text("serial_number", "empty: the device has none");
  Key product = key::text("product", "its name, for people").optional();
  Key rest = key::vector("rest_mm", "mm", {-1e4, 1e4},
                         "where the hand is when a session begins, device frame: right, up, near; until it is within "
                         "10 mm of there the needle waits; absent: it begins wherever the hand is")
                 .optional();
  Key user_from_device = key::quaternion("user_from_device",
                                         "right, up and near of the user from those of the device, which may stand "
                                         "turned on the desk")
                             .otherwise(1, 0, 0, 0);
  Key scale = key::number("scale", "", {0.1, 10},
                          "length in the patient over length of the hand; measured: 150 mm over the shorter side of "
                          "the corners, at least 1, at most 4")
                  .otherwise(1);
  Key deflection = key::object("deflection", files::table_of<kDeflection>,
                               "of axes that spring back, X Y Z Rx Ry Rz as reported, parts of the full deflection; "
                               "absent: the profile's")
                       .optional();
} kCalibration;

std::array<double, 6> six(files::JsonObject& object, const Key& key) {
  if (!object.has(key)) object.problem(key, "is missing; give six numbers, of X Y Z Rx Ry Rz");
  std::array<double, 6> values{};
  const std::vector<double> numbers = object.numbers(key, std::vector<double>(values.size()));
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
  nlohmann::json out{{"format", calibration_format().id}, {"version", calibration_format().version}};
  const auto put = [](nlohmann::json& object, const Key& key, const auto& value) {
    object[std::string(key.name)] = value;
  };
  put(out, kCalibration.vendor_id, hexadecimal(device.vendor_id));
  put(out, kCalibration.product_id, hexadecimal(device.product_id));
  put(out, kCalibration.serial_number, device.serial_number);
  put(out, kCalibration.product, device.product);
  if (calibration.rest) {
    const Eigen::Vector3d rest_mm = 1e3 * *calibration.rest;
    put(out, kCalibration.rest, std::vector<double>(rest_mm.begin(), rest_mm.end()));
  }
  put(out, kCalibration.user_from_device, std::vector<double>{q.w(), q.x(), q.y(), q.z()});
  put(out, kCalibration.scale, calibration.scale);
  if (calibration.centre && calibration.dead_zone) {
    nlohmann::json deflection;
    put(deflection, kDeflection.centre, *calibration.centre);
    put(deflection, kDeflection.dead_zone, *calibration.dead_zone);
    put(out, kCalibration.deflection, deflection);
  }
  return out;
}

}  // namespace

const files::FileFormat& calibration_format() {
  static const files::FileFormat format{
      .name = "calibration",
      .title = "What a user has measured of one device: `stylet devices --calibrate` writes it",
      .table = files::table_of<kCalibration>,
      .id = "stylet-calibration"};
  return format;
}

Calibration read_calibration(files::JsonFile& file, CalibratedDevice* device) {
  files::JsonObject root = file.root(calibration_format());
  CalibratedDevice found;
  found.vendor_id = read_hex_id(root, kCalibration.vendor_id, root.text(kCalibration.vendor_id)).value_or(0);
  found.product_id = read_hex_id(root, kCalibration.product_id, root.text(kCalibration.product_id)).value_or(0);
  found.serial_number = root.text(kCalibration.serial_number);
  found.product = root.text(kCalibration.product);
  Calibration calibration;
  if (root.has(kCalibration.rest)) calibration.rest = 1e-3 * root.vector3(kCalibration.rest);
  calibration.user_from_device = root.quaternion(kCalibration.user_from_device);
  calibration.scale = root.number(kCalibration.scale);
  if (auto deflection = root.object(kCalibration.deflection)) {
    calibration.centre = six(*deflection, kDeflection.centre);
    calibration.dead_zone = six(*deflection, kDeflection.dead_zone);
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
