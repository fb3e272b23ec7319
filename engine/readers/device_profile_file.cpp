#include "engine/readers/device_profile_file.h"

#include "engine/readers/scenario.h"
#include "haptic/hid/usages.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace stylet::readers {

namespace hid = haptic::hid;
namespace fs = std::filesystem;

namespace {

struct NamedUsage {
  std::string_view name;
  hid::Usage usage;
};

constexpr NamedUsage kUsages[] = {
    {"x", hid::usages::kX},
    {"y", hid::usages::kY},
    {"z", hid::usages::kZ},
    {"rx", hid::usages::kRx},
    {"ry", hid::usages::kRy},
    {"rz", hid::usages::kRz},
    {"barrel", hid::usages::kBarrelSwitch},
    {"secondary_barrel", hid::usages::kSecondaryBarrelSwitch},
    {"tip", hid::usages::kTipSwitch},
    {"eraser", hid::usages::kEraser},
    {"in_range", hid::usages::kInRange},
    {"pressure", hid::usages::kTipPressure},
    {"x_tilt", hid::usages::kXTilt},
    {"y_tilt", hid::usages::kYTilt},
    {"azimuth", hid::usages::kAzimuth},
    {"altitude", hid::usages::kAltitude},
    {"twist", hid::usages::kTwist},
    {"scan_time", hid::usages::kScanTime},
};

struct NamedUnit {
  std::string_view name;
  std::uint32_t unit;
  int exponent;
};

// HID counts in cm, g and s.
constexpr NamedUnit kUnits[] = {
    {"", 0, 0},         {"m", 0x11, 2},    {"mm", 0x11, -1},  {"um", 0x11, -4},   {"rad", 0x12, 0},
    {"mrad", 0x12, -3}, {"deg", 0x14, 0},  {"s", 0x1001, 0},  {"ms", 0x1001, -3}, {"us", 0x1001, -6},
    {"n", 0xE111, 5},   {"mn", 0xE111, 2}, {"nm", 0xE121, 7}, {"mnm", 0xE121, 4},
};

struct NamedKind {
  std::string_view name;
  hid::DeviceKind kind;
  hid::Usage application;
};

constexpr NamedKind kKinds[] = {
    {"stylus", hid::DeviceKind::kStylus, hid::usages::kMultiAxisController},
    {"space_mouse", hid::DeviceKind::kSpaceMouse, hid::usages::kMultiAxisController},
    {"pen", hid::DeviceKind::kPen, hid::usages::kPen},
    {"joystick", hid::DeviceKind::kJoystick, hid::usages::kJoystick},
};

hid::DeviceMatch read_match(files::JsonObject& object) {
  hid::DeviceMatch match;
  if (const std::string text = object.text("vendor_id", ""); !text.empty()) {
    match.vendor_id = read_hex_id(object, "vendor_id", text);
  }
  for (const std::string& text : object.texts("product_ids")) {
    if (const auto id = read_hex_id(object, "product_ids", text)) match.product_ids.push_back(*id);
  }
  match.product = object.text("product", "");
  const std::string kind = object.choice("kind", {"any", "stylus", "space_mouse", "pen", "joystick"}, "any");
  for (const NamedKind& named : kKinds) {
    if (named.name == kind) match.kind = named.kind;
  }
  if (!object.has("vendor_id") && match.product_ids.empty() && match.product.empty() && !match.kind) {
    object.problem("", "fits every device; give vendor_id, product_ids, product or kind");
  }
  if (!match.product_ids.empty() && !object.has("vendor_id")) {
    object.problem("product_ids", "mean nothing without vendor_id; give it");
  }
  object.finish();
  return match;
}

/// Rows: the axes of the frame; "-z" means: against the third of what they are made of.
Eigen::Matrix3d read_axes(files::JsonObject& object, const std::string& key, const Eigen::Matrix3d& fallback) {
  const std::vector<std::string> texts = object.texts(key);
  if (texts.empty()) return fallback;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  constexpr std::string_view kLetters = "xyz";
  for (std::size_t row = 0; row < 3 && texts.size() == 3; ++row) {
    const std::string& text = texts[row];
    const auto column = text.size() == 2 ? kLetters.find(text[1]) : std::string::npos;
    if (column == std::string::npos || (text[0] != '+' && text[0] != '-')) break;
    axes(static_cast<int>(row), static_cast<int>(column)) = text[0] == '+' ? 1 : -1;
  }
  if ((axes * axes.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() == 0) return axes;
  object.problem(key, R"(is not three different axes; write such as ["+x", "-z", "+y"])");
  return fallback;
}

void read_limits(files::JsonObject& object, haptic::DeviceLimits& limits) {
  const auto number = [&object](const char* key, files::Range range, double& value) {
    value = object.number(key, range, value);
  };
  number("max_force_n", {0.01, 100}, limits.max_force_n);
  number("continuous_force_n", {0.01, 100}, limits.continuous_force_n);
  number("max_torque_nm", {0, 20}, limits.max_torque_nm);
  number("continuous_torque_nm", {0, 20}, limits.continuous_torque_nm);
  number("thermal_time_constant_s", {0.1, 3600}, limits.thermal_time_constant_s);
  number("max_force_rate_n_per_s", {1, 1e6}, limits.max_force_rate_n_per_s);
  number("max_torque_rate_nm_per_s", {0.01, 1e5}, limits.max_torque_rate_nm_per_s);
  number("max_stiffness_n_per_m", {1, 1e5}, limits.max_stiffness_n_per_m);
  number("max_damping_n_s_per_m", {0, 1000}, limits.max_damping_n_s_per_m);
  number("max_rotational_stiffness_nm_per_rad", {0, 1000}, limits.max_rotational_stiffness_nm_per_rad);
  number("max_rotational_damping_nm_s_per_rad", {0, 10}, limits.max_rotational_damping_nm_s_per_rad);
  number("physical_damping_n_s_per_m", {0, 100}, limits.physical_damping_n_s_per_m);
  number("loop_delay_s", {0, 0.1}, limits.loop_delay_s);
  number("max_speed_m_per_s", {0.01, 20}, limits.max_speed_m_per_s);
  number("max_position_jump_m", {1e-4, 1}, limits.max_position_jump_m);
  number("max_rotation_jump_rad", {1e-3, 3.2}, limits.max_rotation_jump_rad);
  number("stale_pose_fade_s", {1e-3, 0.02}, limits.stale_pose_fade_s);
  number("stale_pose_zero_s", {1e-3, 0.02}, limits.stale_pose_zero_s);
  number("stale_patch_fade_s", {0.02, 0.5}, limits.stale_patch_fade_s);
  number("stale_patch_zero_s", {0.02, 0.5}, limits.stale_patch_zero_s);
  number("engage_force_n", {0.01, 10}, limits.engage_force_n);
  number("engage_rise_s", {0.01, 10}, limits.engage_rise_s);
  const auto expect_order = [&object](const char* lower, double low, const char* upper, double high) {
    if (low > high) object.problem(lower, fmt::format("is {:g}, above {} ({:g})", low, upper, high));
  };
  expect_order("continuous_force_n", limits.continuous_force_n, "max_force_n", limits.max_force_n);
  expect_order("continuous_torque_nm", limits.continuous_torque_nm, "max_torque_nm", limits.max_torque_nm);
  expect_order("stale_pose_fade_s", limits.stale_pose_fade_s, "stale_pose_zero_s", limits.stale_pose_zero_s);
  expect_order("stale_patch_fade_s", limits.stale_patch_fade_s, "stale_patch_zero_s", limits.stale_patch_zero_s);
  object.finish();
}

/// Two whole numbers, the smaller first.
std::array<std::int64_t, 2> read_span(files::JsonObject& object, const std::string& key,
                                      std::array<std::int64_t, 2> fallback) {
  const auto pair = object.numbers(key, 2, {-4294967296.0, 4294967296.0});
  if (pair.size() != 2) return fallback;
  if (pair[0] != std::floor(pair[0]) || pair[1] != std::floor(pair[1]) || pair[0] >= pair[1]) {
    object.problem(key, "is not two whole numbers, the smaller first; use a smaller unit");
    return fallback;
  }
  return {static_cast<std::int64_t>(pair[0]), static_cast<std::int64_t>(pair[1])};
}

hid::Field read_field(files::JsonObject& object, hid::Usage application) {
  hid::Field field{.flags = hid::kVariable, .application = application};
  const std::string usage = object.text("usage");
  for (const NamedUsage& named : kUsages) {
    if (named.name == usage) field.usage = named.usage;
  }
  if (usage.starts_with("button_")) {
    int number = 0;
    const char* end = usage.data() + usage.size();
    if (std::from_chars(usage.data() + 7, end, number).ptr == end && number >= 1 && number <= 32) {
      field.usage = hid::usage(hid::usages::kButtonPage, static_cast<std::uint32_t>(number));
    }
  }
  if (field.usage == 0) {
    std::string names;
    for (const NamedUsage& named : kUsages) names += fmt::format("{}, ", named.name);
    object.problem("usage", fmt::format("is \"{}\", none of {}button_1 to button_32", usage, names));
    field.usage = hid::usages::kX;
  }
  field.bit_offset = static_cast<std::uint32_t>(object.integer("bit", 0, 8 * 4096));
  field.bit_size = static_cast<std::uint32_t>(object.integer("bits", 1, 32));
  const bool is_signed = object.boolean("signed", false);
  const std::int64_t half = std::int64_t{1} << (field.bit_size - 1);
  const std::array<std::int64_t, 2> widest =
      is_signed ? std::array{-half, half - 1} : std::array<std::int64_t, 2>{0, 2 * half - 1};
  const auto logical = read_span(object, "logical", widest);
  if (logical[0] < widest[0] || logical[1] > widest[1] || is_signed != (logical[0] < 0)) {
    object.problem("logical", fmt::format("is not within {} to {}, which {} {}signed bits hold", widest[0], widest[1],
                                          field.bit_size, is_signed ? "" : "un"));
  }
  const auto physical = read_span(object, "physical", {0, 0});
  field.logical_min = logical[0];
  field.logical_max = std::max(logical[0], logical[1]);
  field.physical_min = physical[0];
  field.physical_max = physical[1];
  const std::string unit =
      object.choice("unit", {"", "m", "mm", "um", "rad", "mrad", "deg", "s", "ms", "us", "n", "mn", "nm", "mnm"}, "");
  for (const NamedUnit& named : kUnits) {
    if (named.name != unit) continue;
    field.unit = named.unit;
    field.unit_exponent = named.exponent;
  }
  object.finish();
  return field;
}

hid::VendorReport read_report(files::JsonObject& object, hid::Usage application) {
  hid::VendorReport report;
  report.type = object.choice("type", {"input", "output"}, "input") == "input" ? hid::ReportType::kInput
                                                                               : hid::ReportType::kOutput;
  report.id = static_cast<std::uint8_t>(object.integer("id", 0, 255));
  report.bytes = static_cast<std::uint32_t>(object.integer("bytes", 2, 4096));
  const std::uint32_t bits = 8 * (report.bytes - (report.id != 0 ? 1 : 0));
  for (files::JsonObject& entry : object.objects("fields")) {
    report.fields.push_back(read_field(entry, application));
    const hid::Field& field = report.fields.back();
    if (field.bit_offset + field.bit_size > bits) {
      entry.problem("bit", fmt::format("and bits end at {}, beyond the {} of the report (without its id)",
                                       field.bit_offset + field.bit_size, bits));
    }
  }
  object.finish();
  return report;
}

}  // namespace

std::optional<std::uint16_t> read_hex_id(files::JsonObject& object, const std::string& key, const std::string& text) {
  std::uint16_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id, 16);
  if (error == std::errc{} && end == text.data() + text.size() && text.size() == 4) return id;
  object.problem(key, fmt::format("holds \"{}\"; write four hexadecimal digits, such as \"256f\"", text));
  return std::nullopt;
}

hid::DeviceProfile read_device_profile(files::JsonFile& file) {
  files::JsonObject root = file.root("stylet-device", 1);
  hid::DeviceProfile profile;
  profile.name = root.text("name");
  for (files::JsonObject& entry : root.objects("matches")) profile.matches.push_back(read_match(entry));
  profile.unusable = root.text("unusable", "");
  profile.device_from_report = read_axes(root, "axes", profile.device_from_report);
  profile.rotation_from_report =
      read_axes(root, "rotation_axes", profile.device_from_report * profile.device_from_report.determinant());
  // A file has the needle's axes one by one, which are the columns.
  profile.device_from_needle_at_rest =
      read_axes(root, "needle_at_rest", profile.device_from_needle_at_rest.transpose()).transpose();
  if (profile.device_from_needle_at_rest.determinant() < 0) {
    root.problem("needle_at_rest", "is left-handed; turn one axis round");
    profile.device_from_needle_at_rest = hid::hid_axes();
  }
  if (profile.rotation_from_report.determinant() < 0 &&
      root.choice("rotation", {"rotation_vector", "euler_xyz"}, "rotation_vector") == "euler_xyz") {
    root.problem("rotation_axes", "is left-handed, with which euler_xyz means nothing");
  }
  profile.rotation = root.choice("rotation", {"rotation_vector", "euler_xyz"}, "rotation_vector") == "euler_xyz"
                         ? hid::RotationConvention::kEulerXyz
                         : hid::RotationConvention::kRotationVector;
  profile.scale = root.number("scale", {0.01, 100}, profile.scale);
  profile.workspace_half_m = root.vector3("workspace_mm", {1, 10000}, 2e3 * profile.workspace_half_m) * 0.5e-3;
  if (auto rate = root.object("rate", false)) {
    constexpr double kDegree = std::numbers::pi / 180;
    profile.full_speed_m_per_s =
        rate->number("full_speed_mm_per_s", {1, 1000}, 1e3 * profile.full_speed_m_per_s) * 1e-3;
    profile.full_angular_speed_rad_per_s =
        rate->number("full_angular_speed_deg_per_s", {1, 720}, profile.full_angular_speed_rad_per_s / kDegree) *
        kDegree;
    profile.dead_zone.fill(rate->number("dead_zone", {0, 0.5}, profile.dead_zone[0]));
    rate->finish();
  }
  profile.force_sign = root.boolean("reverse_force", false) ? -1 : 1;
  profile.full_scale_force_n = root.number("full_scale_force_n", {0.01, 1000}, profile.full_scale_force_n);
  if (auto limits = root.object("limits", false)) {
    profile.limits.emplace();
    read_limits(*limits, *profile.limits);
  }
  profile.force_timeout_s = root.number("force_timeout_ms", {0, 1000}, 0) * 1e-3;
  hid::Usage application = 0;
  for (const NamedKind& named : kKinds) {
    for (const hid::DeviceMatch& match : profile.matches) {
      if (match.kind == named.kind) application = named.application;
    }
  }
  for (files::JsonObject& entry : root.objects("reports", false)) {
    profile.vendor_reports.push_back(read_report(entry, application));
    if (application == 0) entry.problem("", "needs to know what the device is; give a kind in matches");
  }
  root.ignore("licence");
  root.ignore("source");
  root.finish();
  return profile;
}

std::vector<hid::DeviceProfile> load_device_profiles(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".json") paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  std::vector<hid::DeviceProfile> profiles;
  for (const fs::path& path : paths) {
    files::JsonFile file(path);
    profiles.push_back(read_device_profile(file));
    file.throw_problems();
  }
  return profiles;
}

std::vector<hid::DeviceProfile> load_device_profiles() {
  return load_device_profiles(content_directory() / "devices");
}

hid::DeviceProfile choose_profile(const std::vector<hid::DeviceProfile>& profiles,
                                  const hid::DeviceIdentity& identity, hid::DeviceKind described) {
  const hid::DeviceProfile* best = nullptr;
  int most = 0;
  for (const hid::DeviceProfile& profile : profiles) {
    if (const int met = profile.match(identity, described); met > most) {
      best = &profile;
      most = met;
    }
  }
  return best != nullptr ? *best : hid::DeviceProfile{};
}

}  // namespace stylet::readers
