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
namespace key = files::key;
using files::Key;
using files::Names;
using files::table_of;

namespace {

constexpr double kDegreesToRadians = std::numbers::pi / 180;
constexpr files::Range kWhole{-4294967296.0, 4294967296.0};
constexpr std::string_view kWholeNumbers = R"({"items": {"type": "integer"}})";

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

template <typename Named, std::size_t n>
Names names_of(const Named (&all)[n]) {
  Names names;
  for (const Named& named : all) names.push_back(named.name);
  return names;
}

Names kind_names() {
  Names names = names_of(kKinds);
  names.insert(names.begin(), "any");
  return names;
}

Names unit_names() {
  return names_of(kUnits);
}

constexpr struct {
  Key vendor_id = key::text("vendor_id", "four hexadecimal digits").optional().schema(kHexId);
  Key product_ids = key::texts("product_ids", "four hexadecimal digits each; absent: any")
                        .optional()
                        .schema(R"({"items": {"pattern": "^[0-9a-fA-F]{4}$"}})");
  Key product = key::text("product", "part of the product's name").optional();
  Key kind =
      key::choice("kind", kind_names, "what its report descriptor, or reports below, make it").otherwise("any");
} kMatch;

constexpr struct {
  Key full_speed = key::number("full_speed_mm_per_s", "mm/s", {1, 1000}, "at full deflection").otherwise(50);
  Key full_angular_speed = key::number("full_angular_speed_deg_per_s", "degrees/s", {1, 720}, "at full deflection")
                               .otherwise(0.8 / kDegreesToRadians);
  Key dead_zone = key::number("dead_zone", "", {0, 0.5}, "part of the deflection without motion").otherwise(0.05);
} kRate;

// What is absent is that of a 3D Systems Touch.
constexpr haptic::DeviceLimits kTouch;
constexpr struct {
  Key max_force = key::number("max_force_n", "N", {0.01, 100}, "largest force, norm").otherwise(kTouch.max_force_n);
  Key continuous_force = key::number("continuous_force_n", "N", {0.01, 100}, "that the motors hold for ever")
                             .otherwise(kTouch.continuous_force_n);
  Key max_torque =
      key::number("max_torque_nm", "N m", {0, 20}, "largest torque; 0: none").otherwise(kTouch.max_torque_nm);
  Key continuous_torque = key::number("continuous_torque_nm", "N m", {0, 20}, "0: as max_torque_nm")
                              .otherwise(kTouch.continuous_torque_nm);
  Key thermal_time_constant = key::number("thermal_time_constant_s", "s", {0.1, 3600}, "of the windings")
                                  .otherwise(kTouch.thermal_time_constant_s);
  Key max_force_rate = key::number("max_force_rate_n_per_s", "N/s", {1, 1e6}, "how fast a force may change")
                           .otherwise(kTouch.max_force_rate_n_per_s);
  Key max_torque_rate = key::number("max_torque_rate_nm_per_s", "N m/s", {0.01, 1e5}, "how fast a torque may change")
                            .otherwise(kTouch.max_torque_rate_nm_per_s);
  Key max_stiffness = key::number("max_stiffness_n_per_m", "N/m", {1, 1e5}, "stable at 1 kHz")
                          .otherwise(kTouch.max_stiffness_n_per_m);
  Key max_damping = key::number("max_damping_n_s_per_m", "N s/m", {0, 1000}, "stable at 1 kHz")
                        .otherwise(kTouch.max_damping_n_s_per_m);
  Key max_rotational_stiffness =
      key::number("max_rotational_stiffness_nm_per_rad", "N m/rad", {0, 1000}, "stable at 1 kHz")
          .otherwise(kTouch.max_rotational_stiffness_nm_per_rad);
  Key max_rotational_damping =
      key::number("max_rotational_damping_nm_s_per_rad", "N m s/rad", {0, 10}, "stable at 1 kHz")
          .otherwise(kTouch.max_rotational_damping_nm_s_per_rad);
  Key physical_damping = key::number("physical_damping_n_s_per_m", "N s/m", {0, 100}, "of the mechanics, motors off")
                             .otherwise(kTouch.physical_damping_n_s_per_m);
  Key loop_delay = key::number("loop_delay_s", "s", {0, 0.1}, "from the motion to the force that answers it")
                       .otherwise(kTouch.loop_delay_s);
  Key max_speed = key::number("max_speed_m_per_s", "m/s", {0.01, 20}, "faster is a device let go: trips")
                      .otherwise(kTouch.max_speed_m_per_s);
  Key max_position_jump = key::number("max_position_jump_m", "m", {1e-4, 1}, "between two readings: trips")
                              .otherwise(kTouch.max_position_jump_m);
  Key max_rotation_jump =
      key::number("max_rotation_jump_rad", "rad", {1e-3, 3.2}, "the same").otherwise(kTouch.max_rotation_jump_rad);
  Key stale_pose_fade =
      key::number("stale_pose_fade_s", "s", {1e-3, 0.02}, "age of the pose at which the force fades")
          .otherwise(kTouch.stale_pose_fade_s);
  Key stale_pose_zero = key::number("stale_pose_zero_s", "s", {1e-3, 0.02}, "age of the pose at which it is zero")
                            .otherwise(kTouch.stale_pose_zero_s);
  Key stale_patch_fade = key::number("stale_patch_fade_s", "s", {0.02, 0.5}, "the same of the tissue patch")
                             .otherwise(kTouch.stale_patch_fade_s);
  Key stale_patch_zero = key::number("stale_patch_zero_s", "s", {0.02, 0.5}, "the same of the tissue patch")
                             .otherwise(kTouch.stale_patch_zero_s);
  Key engage_force =
      key::number("engage_force_n", "N", {0.01, 10}, "the force engages below this").otherwise(kTouch.engage_force_n);
  Key engage_rise =
      key::number("engage_rise_s", "s", {0.01, 10}, "and rises to full in this time").otherwise(kTouch.engage_rise_s);
} kLimitKeys;

constexpr int kButtons = 32;

Names usage_names() {
  static const std::vector<std::string> buttons = [] {
    std::vector<std::string> names;
    for (int i = 1; i <= kButtons; ++i) names.push_back(fmt::format("button_{}", i));
    return names;
  }();
  Names names = names_of(kUsages);
  names.insert(names.end(), buttons.begin(), buttons.end());
  return names;
}

constexpr struct {
  Key usage = key::choice("usage", usage_names, "what it is; x to rz are forces and torques in output reports");
  Key bit = key::integer("bit", {0, 8 * 16384}, "of its first bit, after the id");
  Key bits = key::integer("bits", {1, 32}, "wide");
  Key is_signed = key::boolean("signed", "two's complement").otherwise(false);
  Key logical =
      key::numbers("logical", 2, "", kWhole, "[lowest, highest] whole number; absent: all that the bits hold")
          .optional()
          .schema(kWholeNumbers);
  Key physical =
      key::numbers("physical", 2, "", kWhole, "[lowest, highest] whole number in the unit; absent: as logical")
          .optional()
          .schema(kWholeNumbers);
  Key unit = key::choice("unit", unit_names, "of physical; nm is N m").optional();
} kField;

constexpr struct {
  Key type = key::choice("type", files::one_of<"input", "output">, "which way it goes").otherwise("input");
  Key id = key::integer("id", {0, 255}, "0: not numbered");
  Key bytes = key::integer("bytes", {2, 16384}, "with the id, where there is one");
  Key fields = key::objects("fields", table_of<kField>, "what its bits are");
} kReport;

/// Three of "+x", "-x", ...
constexpr Key axes_key(std::string_view name, std::string_view help) {
  return key::texts(name, help).optional().count({3, 3}).schema(R"({"items": {"pattern": "^[+-][xyz]$"}})");
}

constexpr struct {
  Key name = key::text("name", "shown to the user");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key matches =
      key::objects("matches", table_of<kMatch>,
                   "which devices: any of these, each with all that it gives; of several profiles the closest "
                   "is taken: product before vendor before kind")
          .count({1, -1});
  Key unusable =
      key::text("unusable", "why it cannot be used, with what to do: it is listed with that, and never opened")
          .optional();
  Key axes = axes_key("axes",
                      "right, up and towards the trainee in the reports' X, Y, Z; absent: [\"+x\", \"-z\", "
                      "\"+y\"] (HID 1.11, 5.9)");
  Key rotation_axes =
      axes_key("rotation_axes", "the same for the axes of Rx, Ry, Rz; absent: as axes, by the right hand");
  Key needle_at_rest = axes_key("needle_at_rest",
                                "the needle's X, Y, Z in right, up and near while Rx, Ry, Rz are 0; "
                                "absent: [\"+x\", \"+z\", \"-y\"], it points down");
  Key rotation = key::choice("rotation", files::one_of<"rotation_vector", "euler_xyz">,
                             "rotation_vector: axis times angle; euler_xyz: about the fixed X, then Y, then Z")
                     .otherwise("rotation_vector");
  Key scale = key::number("scale", "", {0.01, 100}, "of positions").otherwise(1);
  Key workspace =
      key::vector("workspace_mm", "mm", {1, 10000}, "box that axes without a length cover, in the reports' axes")
          .otherwise(160, 160, 160);
  Key rate = key::object("rate", table_of<kRate>, "of devices whose axes spring back").optional();
  Key reverse_force = key::boolean("reverse_force", "its firmware pushes the other way").otherwise(false);
  Key full_scale_force = key::number("full_scale_force_n", "N", {0.01, 1000},
                                     "at the end of force fields that say no newtons; absent: max_force_n")
                             .optional();
  Key limits = key::object("limits", table_of<kLimitKeys>,
                           "data sheet (haptic/README.md); what is absent is that of a 3D Systems Touch")
                   .optional();
  Key force_timeout = key::number("force_timeout_ms", "ms", {0, 1000},
                                  "without an output report until the device drops the force; 0: it never does")
                          .otherwise(0);
  Key reports =
      key::objects("reports", table_of<kReport>,
                   "layout of reports that the descriptor calls the vendor's own; matches must then say the "
                   "kind")
          .optional();
} kDevice;

hid::DeviceMatch read_match(files::JsonObject& object) {
  hid::DeviceMatch match;
  if (const std::string text = object.text(kMatch.vendor_id); !text.empty()) {
    match.vendor_id = read_hex_id(object, kMatch.vendor_id, text);
  }
  for (const std::string& text : object.texts(kMatch.product_ids)) {
    if (const auto id = read_hex_id(object, kMatch.product_ids, text)) match.product_ids.push_back(*id);
  }
  match.product = object.text(kMatch.product);
  const std::string kind = object.choice(kMatch.kind);
  for (const NamedKind& named : kKinds) {
    if (named.name == kind) match.kind = named.kind;
  }
  if (!object.has(kMatch.vendor_id) && match.product_ids.empty() && match.product.empty() && !match.kind) {
    object.problem("", "fits every device; give vendor_id, product_ids, product or kind");
  }
  if (!match.product_ids.empty() && !object.has(kMatch.vendor_id)) {
    object.problem(kMatch.product_ids, "mean nothing without vendor_id; give it");
  }
  object.finish();
  return match;
}

/// Rows: the axes of the frame; "-z" means: against the third of what they are made of.
Eigen::Matrix3d read_axes(files::JsonObject& object, const Key& key, const Eigen::Matrix3d& fallback) {
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
  limits.max_force_n = object.number(kLimitKeys.max_force);
  limits.continuous_force_n = object.number(kLimitKeys.continuous_force);
  limits.max_torque_nm = object.number(kLimitKeys.max_torque);
  limits.continuous_torque_nm = object.number(kLimitKeys.continuous_torque);
  limits.thermal_time_constant_s = object.number(kLimitKeys.thermal_time_constant);
  limits.max_force_rate_n_per_s = object.number(kLimitKeys.max_force_rate);
  limits.max_torque_rate_nm_per_s = object.number(kLimitKeys.max_torque_rate);
  limits.max_stiffness_n_per_m = object.number(kLimitKeys.max_stiffness);
  limits.max_damping_n_s_per_m = object.number(kLimitKeys.max_damping);
  limits.max_rotational_stiffness_nm_per_rad = object.number(kLimitKeys.max_rotational_stiffness);
  limits.max_rotational_damping_nm_s_per_rad = object.number(kLimitKeys.max_rotational_damping);
  limits.physical_damping_n_s_per_m = object.number(kLimitKeys.physical_damping);
  limits.loop_delay_s = object.number(kLimitKeys.loop_delay);
  limits.max_speed_m_per_s = object.number(kLimitKeys.max_speed);
  limits.max_position_jump_m = object.number(kLimitKeys.max_position_jump);
  limits.max_rotation_jump_rad = object.number(kLimitKeys.max_rotation_jump);
  limits.stale_pose_fade_s = object.number(kLimitKeys.stale_pose_fade);
  limits.stale_pose_zero_s = object.number(kLimitKeys.stale_pose_zero);
  limits.stale_patch_fade_s = object.number(kLimitKeys.stale_patch_fade);
  limits.stale_patch_zero_s = object.number(kLimitKeys.stale_patch_zero);
  limits.engage_force_n = object.number(kLimitKeys.engage_force);
  limits.engage_rise_s = object.number(kLimitKeys.engage_rise);
  const auto expect_order = [&object](const Key& lower, double low, const Key& upper, double high) {
    if (low > high) object.problem(lower, fmt::format("is {:g}, above {} ({:g})", low, upper.name, high));
  };
  expect_order(kLimitKeys.continuous_force, limits.continuous_force_n, kLimitKeys.max_force, limits.max_force_n);
  expect_order(kLimitKeys.continuous_torque, limits.continuous_torque_nm, kLimitKeys.max_torque,
               limits.max_torque_nm);
  expect_order(kLimitKeys.stale_pose_fade, limits.stale_pose_fade_s, kLimitKeys.stale_pose_zero,
               limits.stale_pose_zero_s);
  expect_order(kLimitKeys.stale_patch_fade, limits.stale_patch_fade_s, kLimitKeys.stale_patch_zero,
               limits.stale_patch_zero_s);
  object.finish();
}

/// Two whole numbers, the smaller first.
std::array<std::int64_t, 2> read_span(files::JsonObject& object, const Key& key,
                                      std::array<std::int64_t, 2> fallback) {
  const auto pair = object.numbers(key);
  if (pair.size() != 2) return fallback;
  if (pair[0] != std::floor(pair[0]) || pair[1] != std::floor(pair[1]) || pair[0] >= pair[1]) {
    object.problem(key, "is not two whole numbers, the smaller first; use a smaller unit");
    return fallback;
  }
  return {static_cast<std::int64_t>(pair[0]), static_cast<std::int64_t>(pair[1])};
}

hid::Field read_field(files::JsonObject& object, hid::Usage application) {
  hid::Field field{.flags = hid::kVariable, .application = application};
  const std::string usage = object.text(kField.usage);
  for (const NamedUsage& named : kUsages) {
    if (named.name == usage) field.usage = named.usage;
  }
  if (usage.starts_with("button_")) {
    int number = 0;
    const char* end = usage.data() + usage.size();
    if (std::from_chars(usage.data() + 7, end, number).ptr == end && number >= 1 && number <= kButtons) {
      field.usage = hid::usage(hid::usages::kButtonPage, static_cast<std::uint32_t>(number));
    }
  }
  if (field.usage == 0) {
    std::string names;
    for (const NamedUsage& named : kUsages) names += fmt::format("{}, ", named.name);
    object.problem(kField.usage, fmt::format("is \"{}\", none of {}button_1 to button_32", usage, names));
    field.usage = hid::usages::kX;
  }
  field.bit_offset = static_cast<std::uint32_t>(object.integer(kField.bit));
  field.bit_size = static_cast<std::uint32_t>(object.integer(kField.bits));
  const bool is_signed = object.boolean(kField.is_signed);
  const std::int64_t half = std::int64_t{1} << (field.bit_size - 1);
  const std::array<std::int64_t, 2> widest =
      is_signed ? std::array{-half, half - 1} : std::array<std::int64_t, 2>{0, 2 * half - 1};
  const auto logical = read_span(object, kField.logical, widest);
  if (logical[0] < widest[0] || logical[1] > widest[1] || is_signed != (logical[0] < 0)) {
    object.problem(kField.logical, fmt::format("is not within {} to {}, which {} {}signed bits hold", widest[0],
                                               widest[1], field.bit_size, is_signed ? "" : "un"));
  }
  const auto physical = read_span(object, kField.physical, {0, 0});
  field.logical_min = logical[0];
  field.logical_max = std::max(logical[0], logical[1]);
  field.physical_min = physical[0];
  field.physical_max = physical[1];
  const std::string unit = object.choice(kField.unit);
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
  report.type = object.choice(kReport.type) == "input" ? hid::ReportType::kInput : hid::ReportType::kOutput;
  report.id = static_cast<std::uint8_t>(object.integer(kReport.id));
  report.bytes = static_cast<std::uint32_t>(object.integer(kReport.bytes));
  const std::uint32_t bits = 8 * (report.bytes - (report.id != 0 ? 1 : 0));
  for (files::JsonObject& entry : object.objects(kReport.fields)) {
    report.fields.push_back(read_field(entry, application));
    const hid::Field& field = report.fields.back();
    if (field.bit_offset + field.bit_size > bits) {
      entry.problem(kField.bit, fmt::format("and bits end at {}, beyond the {} of the report (without its id)",
                                            field.bit_offset + field.bit_size, bits));
    }
  }
  object.finish();
  return report;
}

}  // namespace

std::optional<std::uint16_t> read_hex_id(files::JsonObject& object, const Key& key, const std::string& text) {
  std::uint16_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id, 16);
  if (error == std::errc{} && end == text.data() + text.size() && text.size() == 4) return id;
  object.problem(key, fmt::format("holds \"{}\"; write four hexadecimal digits, such as \"256f\"", text));
  return std::nullopt;
}

const files::FileFormat& device_format() {
  static const files::FileFormat format{.name = "device",
                                        .title = "What a report descriptor does not say of a device",
                                        .table = table_of<kDevice>,
                                        .id = "stylet-device"};
  return format;
}

hid::DeviceProfile read_device_profile(files::JsonFile& file) {
  files::JsonObject root = file.root(device_format());
  hid::DeviceProfile profile;
  profile.name = root.text(kDevice.name);
  for (files::JsonObject& entry : root.objects(kDevice.matches)) profile.matches.push_back(read_match(entry));
  profile.unusable = root.text(kDevice.unusable);
  profile.device_from_report = read_axes(root, kDevice.axes, profile.device_from_report);
  profile.rotation_from_report =
      read_axes(root, kDevice.rotation_axes, profile.device_from_report * profile.device_from_report.determinant());
  // A file has the needle's axes one by one, which are the columns.
  profile.device_from_needle_at_rest =
      read_axes(root, kDevice.needle_at_rest, profile.device_from_needle_at_rest.transpose()).transpose();
  if (profile.device_from_needle_at_rest.determinant() < 0) {
    root.problem(kDevice.needle_at_rest, "is left-handed; turn one axis round");
    profile.device_from_needle_at_rest = hid::hid_axes();
  }
  if (profile.rotation_from_report.determinant() < 0 && root.choice(kDevice.rotation) == "euler_xyz") {
    root.problem(kDevice.rotation_axes, "is left-handed, with which euler_xyz means nothing");
  }
  profile.rotation = root.choice(kDevice.rotation) == "euler_xyz" ? hid::RotationConvention::kEulerXyz
                                                                  : hid::RotationConvention::kRotationVector;
  profile.scale = root.number(kDevice.scale);
  profile.workspace_half_m = root.vector3(kDevice.workspace) * 0.5e-3;
  if (auto rate = root.object(kDevice.rate)) {
    profile.full_speed_m_per_s = rate->number(kRate.full_speed) * 1e-3;
    profile.full_angular_speed_rad_per_s = rate->number(kRate.full_angular_speed) * kDegreesToRadians;
    profile.dead_zone.fill(rate->number(kRate.dead_zone));
    rate->finish();
  }
  profile.force_sign = root.boolean(kDevice.reverse_force) ? -1 : 1;
  profile.full_scale_force_n = root.number(kDevice.full_scale_force, profile.full_scale_force_n);
  if (auto limits = root.object(kDevice.limits)) {
    profile.limits.emplace();
    read_limits(*limits, *profile.limits);
  }
  profile.force_timeout_s = root.number(kDevice.force_timeout) * 1e-3;
  hid::Usage application = 0;
  for (const NamedKind& named : kKinds) {
    for (const hid::DeviceMatch& match : profile.matches) {
      if (match.kind == named.kind) application = named.application;
    }
  }
  for (files::JsonObject& entry : root.objects(kDevice.reports)) {
    profile.vendor_reports.push_back(read_report(entry, application));
    if (application == 0) entry.problem("", "needs to know what the device is; give a kind in matches");
  }
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
