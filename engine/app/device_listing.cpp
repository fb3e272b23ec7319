#include "engine/app/device_listing.h"

#include "engine/readers/device_profile_file.h"
#include "haptic/hid/force_output.h"
#include "haptic/hid/hid_transport.h"
#include "haptic/hid/stylus_map.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace stylet::app {

namespace hid = haptic::hid;
using nlohmann::json;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kAxisNames[] = {"X", "Y", "Z", "Rx", "Ry", "Rz"};

/// What a number is shown in.
struct Shown {
  const char* unit;
  double factor;  ///< shown units in one of SI
};

Shown shown_of(hid::DeviceKind kind, std::uint32_t axis) {
  if (kind == hid::DeviceKind::kSpaceMouse) return {"of full deflection", 1};
  return axis < 3 ? Shown{"mm", 1e3} : Shown{"deg", 1 / kDegree};
}

const char* kind_words(hid::DeviceKind kind, bool force) {
  switch (kind) {
    case hid::DeviceKind::kStylus:
      return force ? "stylus with force" : "stylus without force";
    case hid::DeviceKind::kSpaceMouse:
      return "space mouse: drives the needle by velocity, no force";
    case hid::DeviceKind::kPen:
      return "pen on a tablet, no force";
    case hid::DeviceKind::kJoystick:
      return "joystick with force";
    default:
      return "not usable";
  }
}

json axis_json(const hid::InputSlot& slot, hid::DeviceKind kind) {
  const Shown shown = shown_of(kind, slot.index);
  const auto at = [&](std::int64_t logical) {
    return (static_cast<double>(logical) * slot.scale + slot.offset) * shown.factor;
  };
  return {{"axis", kAxisNames[slot.index]},
          {"min", at(slot.field.logical_min)},
          {"max", at(slot.field.logical_max)},
          {"step", std::abs(slot.scale) * shown.factor},
          {"unit", shown.unit},
          {"report", slot.field.report_id},
          {"bits", slot.field.bit_size}};
}

/// "X Y Z  -1000 to 1000 mm, steps of 0.0001 mm": axes that say the same on one line.
std::string axis_lines(const json& axes, const char* title) {
  std::vector<std::pair<std::string, std::string>> groups;
  for (const json& axis : axes) {
    const std::string range =
        fmt::format("{:.4g} to {:.4g} {}, steps of {:.3g}, {} bits, report {}", axis["min"].get<double>(),
                    axis["max"].get<double>(), axis["unit"].get<std::string>(), axis["step"].get<double>(),
                    axis["bits"].get<int>(), axis["report"].get<int>());
    const auto name = axis["axis"].get<std::string>();
    const auto same = std::ranges::find(groups, range, [](const auto& group) { return group.second; });
    if (same != groups.end()) {
      same->first += " " + name;
    } else {
      groups.emplace_back(name, range);
    }
  }
  std::string text;
  for (const auto& [names, range] : groups) {
    text += fmt::format("  {:<11}{:<9} {}\n", text.empty() ? title : "", names, range);
  }
  return text;
}

/// What else it tells: "pressure, tilt, in range".
std::vector<std::string> extras(const hid::StylusMap& map) {
  std::vector<std::string> words;
  const auto add = [&](bool has, const char* word) {
    if (has) words.emplace_back(word);
  };
  using hid::Quantity;
  add(map.has(Quantity::kPressure), "pressure");
  add(map.has(Quantity::kXTilt) || map.has(Quantity::kAltitude), "tilt");
  add(map.has(Quantity::kTwist), "twist");
  add(map.has(Quantity::kInRange), "in range");
  add(map.has(Quantity::kActuatorsEnabled), "state of the motors");
  return words;
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

void describe_motion(const hid::StylusMap& map, const hid::DeviceProfile& profile, json& out, std::string& text) {
  json axes = json::array();
  for (const hid::InputSlot& slot : map.inputs()) {
    const auto same = [&](const json& axis) { return axis["axis"] == kAxisNames[slot.index]; };
    if (slot.quantity == hid::Quantity::kAxis && std::ranges::none_of(axes, same)) {
      axes.push_back(axis_json(slot, map.kind()));
    }
  }
  text += axis_lines(axes, map.rate_only() ? "deflection" : "position");
  if (map.rate_only()) {
    text += fmt::format("  {:<11}{:.3g} mm/s and {:.3g} deg/s at full deflection, dead zone {:.0f} %\n", "speed",
                        profile.full_speed_m_per_s * 1e3, profile.full_angular_speed_rad_per_s / kDegree,
                        100 * *std::ranges::max_element(profile.dead_zone));
    out["full_speed_mm_per_s"] = profile.full_speed_m_per_s * 1e3;
    out["full_angular_speed_deg_per_s"] = profile.full_angular_speed_rad_per_s / kDegree;
  }
  out["axes"] = std::move(axes);
  out["buttons"] = std::popcount(map.buttons());
  text += fmt::format("  {:<11}{}\n", "buttons", std::popcount(map.buttons()));
  if (const auto words = extras(map); !words.empty()) {
    text += fmt::format("  {:<11}{}\n", "tells", join(words));
    out["tells"] = words;
  }
  if (map.scan_tick_s() > 0) {
    text += fmt::format("  {:<11}Scan Time in steps of {:.4g} us\n", "clock", map.scan_tick_s() * 1e6);
    out["scan_tick_us"] = map.scan_tick_s() * 1e6;
  }
}

/// @param is_hid  it is used without its name too
void describe_force(const hid::ForceOutput& output, bool is_hid, json& out, std::string& text) {
  if (output.way() == hid::ForceOutput::Way::kNone) return;
  const bool sample = output.way() == hid::ForceOutput::Way::kForceSample;
  const char* way = sample ? "PID Download Force Sample" : "PID constant force";
  json axes = json::array();
  std::string names;
  for (const hid::ForceOutput::Axis& axis : output.axes()) {
    const char* unit = axis.index < 3 ? "N" : "N m";
    axes.push_back(
        {{"axis", kAxisNames[axis.index]}, {"max", axis.range}, {"step", std::abs(axis.scale)}, {"unit", unit}});
    names += fmt::format("{}{} {:.3g} {}", names.empty() ? "" : ", ", kAxisNames[axis.index], axis.range, unit);
  }
  const haptic::DeviceLimits& limits = output.limits();
  text += fmt::format("  {:<11}{} by {}, {} report(s) each\n", "force", names, way, output.report_count());
  text += fmt::format(
      "  {:<11}{:.3g} N, {:.3g} N for ever, {:.0f} N/m and {:.3g} N s/m at 1 kHz{}\n", "limits", limits.max_force_n,
      limits.continuous_force_n, limits.max_stiffness_n_per_m, limits.max_damping_n_s_per_m,
      output.held_s() > 0
          ? fmt::format("; drops the force {:.0f} ms after the host falls silent", output.held_s() * 1e3)
          : "; does NOT drop the force by itself");
  if (!output.lets_go()) {
    text += fmt::format(
        "  {:<11}{}\n", "warning",
        is_hid ? "its force would stay on if the computer stopped: used only by name, --device hid:VID:PID"
               : "its force may stay on if this computer stops; be ready to switch it off");
  }
  out["force"] = {{"way", way},
                  {"axes", std::move(axes)},
                  {"max_force_n", limits.max_force_n},
                  {"continuous_force_n", limits.continuous_force_n},
                  {"max_stiffness_n_per_m", limits.max_stiffness_n_per_m},
                  {"max_damping_n_s_per_m", limits.max_damping_n_s_per_m},
                  {"timeout_ms", output.held_s() * 1e3},
                  {"by_name_only", is_hid && !output.lets_go()}};
}

}  // namespace

json describe_device(const ListedDevice& device, std::span<const std::uint8_t> descriptor,
                     const std::vector<hid::DeviceProfile>& profiles) {
  json out = {{"path", device.path},
              {"vendor_id", fmt::format("{:04x}", device.identity.vendor_id)},
              {"product_id", fmt::format("{:04x}", device.identity.product_id)},
              {"manufacturer", device.manufacturer},
              {"product", device.identity.product},
              {"serial_number", device.serial_number}};
  std::string title = device.path;
  if (device.identity.vendor_id != 0) {
    title += fmt::format("  {:04x}:{:04x}", device.identity.vendor_id, device.identity.product_id);
  }
  if (!device.identity.product.empty()) title += "  " + device.identity.product;
  if (!device.manufacturer.empty()) title += fmt::format(" ({})", device.manufacturer);
  std::string text = title + "\n";
  hid::DeviceKind kind = hid::DeviceKind::kUnusable;
  std::string reason;
  try {
    const hid::ReportDescriptor parsed = hid::parse_report_descriptor(descriptor);
    const hid::DeviceProfile profile = readers::choose_profile(profiles, device.identity, hid::kind_of(parsed));
    const hid::ReportDescriptor full = hid::with_vendor_reports(parsed, profile);
    const hid::StylusMap map(full, profile);
    const hid::ForceOutput output(full, profile);
    kind = map.kind();
    reason = map.reason();
    if (!profile.name.empty()) out["profile"] = profile.name;
    if (map.usable()) {
      text += fmt::format("  {}{}\n", kind_words(kind, output.limits().renders_force),
                          profile.name.empty() ? "" : fmt::format("; profile \"{}\"", profile.name));
      describe_motion(map, profile, out, text);
      if (!device.state.empty()) {  // of those that tell it no report says how far they go
        const Eigen::Vector3d size_mm = 2e3 * profile.workspace_half_m;
        out["workspace_mm"] = {size_mm.x(), size_mm.y(), size_mm.z()};
        text +=
            fmt::format("  {:<11}{:.0f} x {:.0f} x {:.0f} mm\n", "workspace", size_mm.x(), size_mm.y(), size_mm.z());
      }
      describe_force(output, device.state.empty(), out, text);
    }
    for (const hid::DescriptorWarning& warning : parsed.warnings) {
      out["warnings"].push_back(fmt::format("byte {}: {}", warning.byte_offset, warning.text));
      text += fmt::format("  {:<11}report descriptor, byte {}: {}\n", "warning", warning.byte_offset, warning.text);
    }
  } catch (const hid::DescriptorError& error) {
    reason = error.what();
  }
  if (!device.state.empty()) {
    out["state"] = device.state;
    text += fmt::format("  {:<11}{}\n", "state", device.state);
  }
  if (!device.interval.empty()) {
    out["interval"] = device.interval;
    if (kind != hid::DeviceKind::kUnusable)
      text += fmt::format("  {:<11}a report every {}\n", "rate", device.interval);
  }
  if (kind == hid::DeviceKind::kUnusable) text += fmt::format("  not usable: {}\n", reason);
  if (kind != hid::DeviceKind::kUnusable && !device.may_open) {
    reason = "no permission to open it";
    const std::string rule = hid::udev_rule_line(device.identity.vendor_id, device.identity.product_id);
    out["udev_rule"] = rule;
    text += fmt::format(
        "  not usable yet: no permission to open it. Put this line into {}:\n"
        "    {}\n"
        "  then run `sudo udevadm control --reload && sudo udevadm trigger` and plug the device in again.\n",
        hid::kUdevRulesFile, rule);
  }
  out["kind"] = hid::name_of(kind);
  out["usable"] = kind != hid::DeviceKind::kUnusable && device.may_open;
  if (!reason.empty()) out["reason"] = reason;
  out["text"] = text;
  return out;
}

std::string field_table(const hid::ReportDescriptor& descriptor) {
  std::string text = "  report       bit  bits   usage     logical range              flags\n";
  for (const hid::Field& field : descriptor.fields) {
    std::string flags = field.is(hid::kConstant) ? "constant" : "data";
    flags += field.is(hid::kVariable) ? " variable" : " array";
    if (field.is(hid::kRelative)) flags += " relative";
    if (field.is(hid::kNullState)) flags += " null";
    text += fmt::format(
        "  {:<7} {:>3} {:>5}  {:<6} {}  {:<26} {}\n", hid::name_of(field.type), field.report_id, field.bit_offset,
        field.count > 1 ? fmt::format("{}x{}", field.bit_size, field.count) : std::to_string(field.bit_size),
        field.padding() ? "padding  " : fmt::format("{:04x}:{:04x}", field.usage >> 16, field.usage & 0xFFFF),
        fmt::format("{} to {}", field.logical_min, field.logical_max), flags);
  }
  return text;
}

}  // namespace stylet::app
