#include "haptic/hid/stylus_map.h"

#include "haptic/hid/usages.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>

namespace stylet::haptic::hid {
namespace {

namespace u = usages;

/// A cap on springs says that it moves by millimetres; a stylus moves by more.
constexpr double kLeastWorkspace = 0.01;  // m, from end to end
constexpr double kLeastTablet = 0.02;     // m
constexpr double kLargestTablet = 2.0;    // m
constexpr double kSteepest = 85 * std::numbers::pi / 180;

/// Wacom's own page 0xFF0D mirrors the digitizer's; its X and Y are 0x130 and 0x131.
Usage standard(Usage usage) {
  if (usage >> 16 != 0xFF0D) return usage;
  const Usage id = usage & 0xFFFF;
  if (id == 0x130) return u::kX;
  if (id == 0x131) return u::kY;
  return hid::usage(0x0D, id);
}

int axis_of(Usage usage) {
  return usage >= u::kX && usage <= u::kRz ? static_cast<int>(usage - u::kX) : -1;
}

bool carries_data(const Field& field) {
  return field.type == ReportType::kInput && !field.padding() && !field.is(kConstant) && field.bit_size <= 32;
}

double logical_span(const Field& field) {
  return static_cast<double>(field.logical_max) - static_cast<double>(field.logical_min);
}

bool within_any(const ReportDescriptor& descriptor, const Field& field, std::initializer_list<Usage> usages) {
  for (std::int32_t k = field.collection; k >= 0; k = descriptor.collections[k].parent) {
    for (const Usage usage : usages) {
      if (standard(descriptor.collections[k].usage) == usage) return true;
    }
  }
  return false;
}

bool on_controller(const ReportDescriptor& descriptor, const Field& field) {
  return within_any(descriptor, field, {u::kMultiAxisController});
}

bool touched(const ReportDescriptor& descriptor, const Field& field) {
  return within_any(descriptor, field, {u::kTouchScreen, u::kTouchPad, u::kFinger});
}

bool on_stick(const ReportDescriptor& descriptor, const Field& field) {
  return within_any(descriptor, field, {u::kJoystick, u::kGamePad, u::kMultiAxisController}) ||
         field.application >> 16 == 0x02;
}

/// Whether an axis says where, not how far it is pushed.
bool is_place(const Field& field) {
  const Conversion conversion = conversion_of(field);
  return !field.is(kRelative) && conversion.dimension == kMetres &&
         std::abs(conversion.scale) * logical_span(field) >= kLeastWorkspace;
}

/// Reports of a pen: X and Y, absolute, beside the pressure of a tip, or as a pen's.
std::set<std::uint8_t> pen_reports(const ReportDescriptor& descriptor) {
  std::set<std::uint8_t> with_x;
  std::set<std::uint8_t> with_y;
  std::set<std::uint8_t> with_pen;
  for (const Field& field : descriptor.fields) {
    if (!carries_data(field) || field.array() || field.is(kRelative) || touched(descriptor, field)) continue;
    const Usage usage = standard(field.usage);
    // Some declare X and Y of one bit so that a driver that wants axes is content.
    if (usage == u::kX && logical_span(field) > 1) with_x.insert(field.report_id);
    if (usage == u::kY && logical_span(field) > 1) with_y.insert(field.report_id);
    if (usage == u::kTipPressure || within_any(descriptor, field, {u::kPen, u::kStylus})) {
      with_pen.insert(field.report_id);
    }
  }
  std::set<std::uint8_t> pen;
  for (const std::uint8_t id : with_x) {
    if (with_y.contains(id) && with_pen.contains(id)) pen.insert(id);
  }
  return pen;
}

bool has_force(const ReportDescriptor& descriptor) {
  return std::ranges::any_of(descriptor.fields, [&](const Field& field) {
    return field.type == ReportType::kOutput &&
           ((axis_of(field.usage) >= 0 && descriptor.within(field, u::kDownloadForceSample)) ||
            (field.usage == u::kMagnitude && descriptor.within(field, u::kSetConstantForce)));
  });
}

/// The part of a device that an application collection is, for a reason.
std::string part(const ReportDescriptor& descriptor, const Field& field) {
  switch (standard(field.application)) {
    case u::kMouse:
    case u::kPointer:
      return "a mouse (`--device mouse` takes any)";
    case u::kKeyboard:
    case u::kKeypad:
      return "a keyboard";
    case u::kJoystick:
    case u::kGamePad:
      return "a joystick without force feedback of the standard kind (PID)";
    case u::kTouchScreen:
    case u::kTouchPad:
      return "a touch surface, which sees fingers and no stylus";
    default:
      break;
  }
  if (touched(descriptor, field)) return "a touch surface, which sees fingers and no stylus";
  switch (field.application >> 16) {
    case 0x01:
      return "system controls";
    case 0x0C:
      return "media keys";
    case 0x0D:
      return "a digitizer whose reports say no position";
    default:
      break;
  }
  if (u::is_vendor(field.application) || u::is_vendor(field.usage)) return "reports of the vendor's own kind";
  return "controls without a position";
}

/// Why nothing of a device can drive a needle.
std::string why_not(const ReportDescriptor& descriptor) {
  std::vector<std::string> parts;
  bool vendor = false;
  for (const Field& field : descriptor.fields) {
    if (field.type != ReportType::kInput || field.padding()) continue;
    const std::string text = part(descriptor, field);
    vendor = vendor || text.starts_with("reports of the vendor");
    if (std::ranges::find(parts, text) == parts.end()) parts.push_back(text);
  }
  if (parts.empty()) return "it sends no input reports";
  std::string text = "it has only ";
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k > 0) text += k + 1 == parts.size() ? " and " : ", ";
    text += parts[k];
  }
  if (vendor) text += "; a profile that gives their layout makes it usable (content/README.md, Devices)";
  return text;
}

/// value = logical * scale + offset.
void set_conversion(InputSlot& slot, double scale, double offset) {
  slot.scale = scale;
  slot.offset = offset;
}

/// Logical range onto -half to half.
void set_centred(InputSlot& slot, double half) {
  const double span = logical_span(slot.field);
  const double scale = span > 0 ? 2 * half / span : 0;
  set_conversion(slot, scale, -half - scale * static_cast<double>(slot.field.logical_min));
}

void set_axis(InputSlot& slot, DeviceKind kind, const DeviceProfile& profile) {
  const Field& field = slot.field;
  const Conversion conversion = conversion_of(field);
  const bool turns = slot.index >= 3;
  const double half = turns ? std::numbers::pi : profile.workspace_half_m[static_cast<int>(slot.index)];
  const double size = std::abs(conversion.scale) * logical_span(field);
  if (kind == DeviceKind::kSpaceMouse) {
    // Their lengths are those of the cap. Zero is the middle, whatever the ends.
    const double end =
        std::max(std::abs(static_cast<double>(field.logical_min)), std::abs(static_cast<double>(field.logical_max)));
    return set_conversion(slot, end > 0 ? 1 / end : 0, 0);
  }
  if (kind == DeviceKind::kStylus && conversion.dimension == (turns ? kRadians : kMetres)) {
    return set_conversion(slot, conversion.scale, conversion.offset);
  }
  if (kind == DeviceKind::kPen && conversion.dimension == kMetres && size > kLeastTablet && size < kLargestTablet) {
    return set_centred(slot, std::copysign(size / 2, conversion.scale));
  }
  set_centred(slot, half);
}

/// Radians. Pens that say no unit, or one left over from another field, mean degrees or hundredths of them.
void set_angle(InputSlot& slot) {
  const Conversion conversion = conversion_of(slot.field);
  const double end = std::abs(conversion.scale) * logical_span(slot.field);
  if (conversion.dimension == kRadians && end > 0.1 && end < 7) {
    return set_conversion(slot, conversion.scale, conversion.offset);
  }
  const double degree = logical_span(slot.field) > 720 ? 0.01 : 1;
  set_conversion(slot, degree * std::numbers::pi / 180, 0);
}

/// The 32 buttons of a reading that a field of the button page stands for; 32: none.
std::uint32_t button_bit(Usage usage) {
  const Usage number = usage & 0xFFFF;
  return usage >> 16 == u::kButtonPage && number >= 1 && number <= 32 ? number - 1 : 32;
}

std::uint32_t bit_number(std::uint32_t mask) {
  std::uint32_t bit = 0;
  while (mask >> bit > 1) ++bit;
  return bit;
}

/// What a field is to a device of this kind. @return false: nothing
bool assign(InputSlot& slot, DeviceKind kind, const DeviceProfile& profile) {
  const Usage usage = standard(slot.field.usage);
  if (const int axis = axis_of(usage); axis >= 0) {
    if (kind == DeviceKind::kPen && axis > 1) return false;
    if (kind == DeviceKind::kJoystick && axis > 2) return false;
    slot.quantity = Quantity::kAxis;
    slot.index = static_cast<std::uint32_t>(axis);
    set_axis(slot, kind, profile);
    return true;
  }
  if (usage >> 16 == u::kButtonPage) {
    slot.quantity = slot.field.array() ? Quantity::kButtonArray : Quantity::kButton;
    slot.index = slot.field.array() ? usage & 0xFFFF : button_bit(usage);
    return slot.index < 32 || slot.field.array();
  }
  if (slot.field.array()) return false;
  const auto button = [&](std::uint32_t mask) {
    slot.quantity = Quantity::kButton;
    slot.index = bit_number(mask);
    return true;
  };
  const auto plain = [&](Quantity quantity) {
    slot.quantity = quantity;
    return true;
  };
  const auto angle = [&](Quantity quantity) {
    slot.quantity = quantity;
    set_angle(slot);
    return true;
  };
  switch (usage) {
    case u::kBarrelSwitch:
      return button(kBarrelButton);
    case u::kSecondaryBarrelSwitch:
      return button(kSecondaryBarrelButton);
    case u::kTipSwitch:
      return button(kTip);
    case u::kEraser:
      return button(kEraserButton);
    case u::kTipPressure:
      set_conversion(
          slot, logical_span(slot.field) > 0 ? 1 / logical_span(slot.field) : 0,
          logical_span(slot.field) > 0 ? -static_cast<double>(slot.field.logical_min) / logical_span(slot.field) : 0);
      return plain(Quantity::kPressure);
    case u::kXTilt:
      return angle(Quantity::kXTilt);
    case u::kYTilt:
      return angle(Quantity::kYTilt);
    case u::kAzimuth:
      return angle(Quantity::kAzimuth);
    case u::kAltitude:
      return angle(Quantity::kAltitude);
    case u::kTwist:
      return angle(Quantity::kTwist);
    case u::kInRange:
      return plain(Quantity::kInRange);
    case u::kScanTime:
      return plain(Quantity::kScanTime);
    case u::kActuatorsEnabled:
      return plain(Quantity::kActuatorsEnabled);
    case u::kSafetySwitch:
      return plain(Quantity::kSafetySwitch);
    case u::kActuatorPower:
      return plain(Quantity::kActuatorPower);
    default:
      return false;
  }
}

}  // namespace

DeviceKind kind_of(const ReportDescriptor& descriptor, std::string* reason) {
  std::array<bool, 3> place{};
  std::array<bool, 3> deflection{};
  bool stick = false;
  for (const Field& field : descriptor.fields) {
    const int axis = axis_of(field.usage);
    if (!carries_data(field) || field.array() || axis < 0 || axis > 2) continue;
    if (on_controller(descriptor, field)) (is_place(field) ? place : deflection)[axis] = true;
    stick = stick || (on_stick(descriptor, field) && !field.is(kRelative));
  }
  const auto all = [](const std::array<bool, 3>& axes) { return axes[0] && axes[1] && axes[2]; };
  if (all(place)) return DeviceKind::kStylus;
  if (all(deflection)) return DeviceKind::kSpaceMouse;
  if (!pen_reports(descriptor).empty()) return DeviceKind::kPen;
  if (stick && has_force(descriptor)) return DeviceKind::kJoystick;
  if (reason != nullptr) *reason = why_not(descriptor);
  return DeviceKind::kUnusable;
}

StylusMap::StylusMap(const ReportDescriptor& descriptor, const DeviceProfile& profile) : profile_(profile) {
  kind_ = kind_of(descriptor, &reason_);
  if (!profile.unusable.empty()) {
    kind_ = DeviceKind::kUnusable;
    reason_ = profile.unusable;
  }
  for (const Report& report : descriptor.reports) {
    if (report.type != ReportType::kInput) continue;
    reports_[report.id] = {.declared = true, .bytes = static_cast<std::uint32_t>(report.bytes())};
    numbered_ = numbered_ || report.id != 0;
    max_input_bytes_ = std::max(max_input_bytes_, report.bytes());
  }
  if (!usable()) return;

  const std::set<std::uint8_t> pens = pen_reports(descriptor);
  for (const Field& field : descriptor.fields) {
    if (!carries_data(field)) continue;
    const bool ours = kind_ == DeviceKind::kPen        ? pens.contains(field.report_id) && !touched(descriptor, field)
                      : kind_ == DeviceKind::kJoystick ? on_stick(descriptor, field)
                                                       : on_controller(descriptor, field);
    InputSlot slot{.field = field};
    if (!ours || !assign(slot, kind_, profile_)) continue;
    const auto same = [&](const InputSlot& other) {
      return other.field.report_id == field.report_id && other.quantity == slot.quantity && other.index == slot.index;
    };
    if (std::ranges::none_of(slots_, same)) slots_.push_back(slot);
  }
  std::ranges::stable_sort(slots_, {}, [](const InputSlot& slot) { return slot.field.report_id; });
  for (std::uint32_t k = 0; k < slots_.size(); ++k) {
    InputReport& report = reports_[slots_[k].field.report_id];
    if (report.count++ == 0) report.first = k;
  }
  says_in_range_ = has(Quantity::kInRange);
  by_altitude_ = has(Quantity::kAltitude) && !has(Quantity::kXTilt);
  for (const InputSlot& slot : slots_) {
    if (slot.quantity != Quantity::kScanTime) continue;
    const Conversion conversion = conversion_of(slot.field);
    scan_tick_s_ = conversion.dimension == kSeconds && conversion.scale > 0 ? conversion.scale : 1e-4;
    scan_modulus_ = static_cast<std::uint64_t>(slot.field.logical_max) + 1;
    break;
  }
}

namespace {

std::uint32_t buttons_of(const InputSlot& slot) {
  if (slot.quantity == Quantity::kButton) return 1U << slot.index;
  if (slot.quantity != Quantity::kButtonArray) return 0;
  const auto count = std::clamp<std::int64_t>(slot.field.logical_max - slot.field.logical_min + 1, 0, 32);
  const std::uint64_t from_1 = ((std::uint64_t{1} << count) - 1) << std::min(slot.index, 32U);
  return static_cast<std::uint32_t>(from_1 >> 1);
}

}  // namespace

std::uint32_t StylusMap::buttons() const {
  std::uint32_t all = 0;
  for (const InputSlot& slot : slots_) all |= buttons_of(slot);
  return all;
}

int StylusMap::free_button(std::uint32_t taken) const {
  if (kind_ == DeviceKind::kPen) return 0;
  std::uint32_t free = 0;
  for (const InputSlot& slot : slots_) {
    if (slot.field.usage >> 16 == u::kButtonPage) free |= buttons_of(slot);
  }
  free &= ~(taken | 1U);
  return free == 0 ? 0 : std::countr_zero(free) + 1;
}

bool StylusMap::has(Quantity quantity, std::uint32_t index) const {
  return std::ranges::any_of(slots_,
                             [&](const InputSlot& slot) { return slot.quantity == quantity && slot.index == index; });
}

/// @return false: the report cannot be used
bool StylusMap::take(const InputSlot& slot, std::span<const std::uint8_t> data, HidReading& next,
                     bool& present) const noexcept {
  const Field& field = slot.field;
  std::int64_t logical = extract(data, field);
  const bool sound = in_range(field, logical);
  if (slot.quantity == Quantity::kAxis && !sound) {
    if (kind_ == DeviceKind::kStylus) return false;
    if (kind_ == DeviceKind::kPen) {
      present = false;
      return true;
    }
  } else if (!sound && field.is(kNullState)) {
    return true;  // no value
  }
  logical = std::clamp(logical, field.logical_min, field.logical_max);
  const double value = static_cast<double>(logical) * slot.scale + slot.offset;
  const bool on = logical != 0;
  switch (slot.quantity) {
    case Quantity::kAxis:
      next.axes[slot.index] = value;
      if (rate_only()) {
        next.carries |= slot.index < 3 ? kVelocity : kAngularVelocity;
      } else {
        next.carries |= slot.index < 3 ? kPosition : kOrientation;
      }
      break;
    case Quantity::kButton:
      next.buttons = on ? next.buttons | 1U << slot.index : next.buttons & ~(1U << slot.index);
      next.carries |= kButtons;
      break;
    case Quantity::kButtonArray:
      next.buttons = 0;
      for (std::uint32_t k = 0; k < field.count; ++k) {
        const std::int64_t number = extract(data, field, k) - field.logical_min + slot.index;
        if (number >= 1 && number <= 32) next.buttons |= 1U << (number - 1);
      }
      next.carries |= kButtons;
      break;
    case Quantity::kPressure:
      next.pressure = value;
      next.carries |= kPressure;
      break;
    case Quantity::kXTilt:
    case Quantity::kYTilt:
      next.tilt[slot.quantity == Quantity::kYTilt ? 1 : 0] = value;
      next.carries |= kTilt;
      break;
    case Quantity::kAzimuth:
      next.azimuth = value;
      next.carries |= kTilt;
      break;
    case Quantity::kAltitude:
      next.altitude = value;
      next.carries |= kTilt;
      break;
    case Quantity::kTwist:
      next.twist = value;
      next.carries |= kTwist;
      break;
    case Quantity::kInRange:
      next.in_range = on;
      next.carries |= kPresence;
      break;
    case Quantity::kScanTime:
      next.scan_time = static_cast<std::uint32_t>(logical);
      next.carries |= hid::kScanTime;
      break;
    case Quantity::kActuatorsEnabled:
      next.actuators_enabled = on;
      next.carries |= kActuators;
      break;
    case Quantity::kSafetySwitch:
      next.safety_switch = on;
      next.carries |= kActuators;
      break;
    case Quantity::kActuatorPower:
      next.actuator_power = on;
      next.carries |= kActuators;
      break;
  }
  return true;
}

void StylusMap::pose(HidReading& next) const noexcept {
  const Eigen::Vector3d move(next.axes[0], next.axes[1], next.axes[2]);
  const Eigen::Vector3d turn(next.axes[3], next.axes[4], next.axes[5]);
  if (rate_only()) {
    // The zone round the middle is cut out, and what is left starts from zero.
    std::array<double, 6> push{};
    for (std::size_t axis = 0; axis < push.size(); ++axis) {
      const double zone = profile_.dead_zone[axis];
      const double part = next.axes[axis] - profile_.centre[axis];
      const double size = (std::abs(part) - zone) / (1 - zone - std::abs(profile_.centre[axis]));
      push[axis] = std::copysign(std::clamp(size, 0.0, 1.0), part);
    }
    next.velocity =
        profile_.device_from_report * Eigen::Map<Eigen::Vector3d>(push.data()) * profile_.full_speed_m_per_s;
    next.angular_velocity = profile_.rotation_from_report * Eigen::Map<Eigen::Vector3d>(push.data() + 3) *
                            profile_.full_angular_speed_rad_per_s;
    return;
  }
  next.position = profile_.scale * (profile_.device_from_report * move);
  if (kind_ == DeviceKind::kPen) {
    Eigen::Vector3d up;
    if (by_altitude_) {
      up = {std::cos(next.altitude) * std::cos(next.azimuth), std::sin(next.altitude),
            -std::cos(next.altitude) * std::sin(next.azimuth)};
    } else {
      up = {std::tan(std::clamp(next.tilt.x(), -kSteepest, kSteepest)), 1,
            std::tan(std::clamp(next.tilt.y(), -kSteepest, kSteepest))};
    }
    Eigen::Matrix3d needle;
    needle.col(2) = -up.normalized();
    const Eigen::Vector3d side =
        std::abs(needle(0, 2)) < 0.9999 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
    needle.col(1) = needle.col(2).cross(side).normalized();
    needle.col(0) = needle.col(1).cross(needle.col(2));
    next.orientation = Eigen::Quaterniond(needle) * Eigen::AngleAxisd(next.twist, Eigen::Vector3d::UnitZ());
    return;
  }
  const Eigen::Matrix3d& axes = profile_.rotation_from_report;
  Eigen::Quaterniond turned;
  if (profile_.rotation == RotationConvention::kRotationVector) {
    const double angle = turn.norm();
    turned = angle > 1e-12 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, axes * turn / angle))
                           : Eigen::Quaterniond::Identity();
  } else {
    turned = Eigen::AngleAxisd(turn.z(), axes.col(2)) * Eigen::AngleAxisd(turn.y(), axes.col(1)) *
             Eigen::AngleAxisd(turn.x(), axes.col(0));
  }
  next.orientation = turned * Eigen::Quaterniond(profile_.device_from_needle_at_rest);
}

Decoded StylusMap::decode(std::span<const std::uint8_t> report, HidReading& reading) const noexcept {
  if (report.empty()) return Decoded::kTruncated;
  const InputReport& expected = reports_[numbered_ ? report[0] : 0];
  if (!expected.declared) return Decoded::kUndeclared;
  if (report.size() < expected.bytes) return Decoded::kTruncated;
  if (report.size() > expected.bytes) return Decoded::kOversized;
  if (expected.count == 0) return Decoded::kNothing;
  const std::span<const std::uint8_t> data = report.subspan(numbered_ ? 1 : 0);
  HidReading next = reading;
  next.carries = 0;
  bool present = true;
  for (std::uint32_t k = 0; k < expected.count; ++k) {
    if (!take(slots_[expected.first + k], data, next, present)) return Decoded::kOutOfRange;
  }
  if (!present) {
    next.in_range = false;
    next.axes = reading.axes;
    next.carries &= ~static_cast<std::uint32_t>(kPosition);
  } else if ((next.carries & (kPosition | kVelocity | kAngularVelocity)) != 0 && !says_in_range_) {
    next.in_range = true;
  }
  if (kind_ == DeviceKind::kPen && (next.carries & (kTilt | kTwist)) != 0) next.carries |= kOrientation;
  pose(next);
  reading = next;
  return Decoded::kReading;
}

}  // namespace stylet::haptic::hid
