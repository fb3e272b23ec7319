#include "haptic/hid/force_output.h"

#include "haptic/hid/usages.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic::hid {
namespace {

namespace u = usages;

int force_axis(Usage usage) {
  return usage >= u::kX && usage <= u::kRz ? static_cast<int>(usage - u::kX) : -1;
}

/// A report put together by usages: what the device does not declare is left at zero.
class Writer {
public:
  Writer(const ReportDescriptor& descriptor, ReportType type, Usage collection)
      : descriptor_(descriptor), type_(type), collection_(collection) {
    for (const Field& field : descriptor.fields) {
      if (field.type != type || !descriptor.within(field, collection)) continue;
      id_ = field.report_id;
      const Report* report = descriptor.report(type, id_);
      bytes_.assign(1 + (report->bits + 7) / 8, 0);
      bytes_[0] = id_;
      return;
    }
  }

  bool exists() const { return !bytes_.empty(); }
  std::vector<std::uint8_t>& bytes() { return bytes_; }

  /// The field of this report with the usage, in the collection if one is given.
  const Field* find(Usage usage, Usage inner = 0) const {
    for (const Field& field : descriptor_.fields) {
      if (field.type != type_ || field.report_id != id_ || field.is(kConstant)) continue;
      if (inner != 0 ? !descriptor_.within(field, inner) : !descriptor_.within(field, collection_)) continue;
      if (usage == 0 || field.usage == usage) return &field;
    }
    return nullptr;
  }

  bool put(const Field* field, std::int64_t value) {
    if (field == nullptr) return false;
    insert(std::span(bytes_).subspan(1), *field, value);
    return true;
  }
  bool put(Usage usage, std::int64_t value) { return put(find(usage), value); }
  /// The choice `usage` of an array in the collection `inner`; where there are bits instead, its bit.
  bool choose(Usage usage, Usage inner) {
    for (const Field& field : descriptor_.fields) {
      if (field.type != type_ || field.report_id != id_ || !descriptor_.within(field, inner)) continue;
      if (field.array()) {
        if (const auto value = descriptor_.selector(field, usage)) return put(&field, *value);
      } else if (field.usage == usage) {
        return put(&field, 1);
      }
    }
    return false;
  }

private:
  const ReportDescriptor& descriptor_;
  ReportType type_;
  Usage collection_;
  std::uint8_t id_ = 0;
  std::vector<std::uint8_t> bytes_;
};

constexpr std::array<Usage, 4> kControlUsages = {u::kEnableActuators, u::kDisableActuators, u::kStopAllEffects,
                                                 u::kDeviceReset};

}  // namespace

ForceOutput::Layout ForceOutput::layout(const ReportDescriptor& descriptor, const Field& field) const {
  const Report* report = descriptor.report(field.type, field.report_id);
  return {.id = field.report_id, .bytes = 1 + (report->bits + 7) / 8};
}

ForceOutput::ForceOutput(const ReportDescriptor& descriptor, const DeviceProfile& profile)
    : force_from_device_(profile.device_from_report.transpose()),
      torque_from_device_(profile.rotation_from_report.transpose()),
      force_sign_(profile.force_sign),
      limits_(profile.limits.value_or(DeviceLimits{})),
      force_timeout_s_(profile.force_timeout_s),
      descriptor_(descriptor) {
  full_scale_ = profile.full_scale_force_n > 0 ? profile.full_scale_force_n : limits_.max_force_n;
  if (profile.unusable.empty()) find_force_sample(descriptor);
  if (profile.unusable.empty() && axes_.empty()) find_constant_force(descriptor);
  find_controls(descriptor);
  limits_.renders_force = way_ != Way::kNone;
  double force = 0;
  double torque = 0;
  for (const Axis& axis : axes_) {
    double& most = axis.index < 3 ? force : torque;
    most = most == 0 ? axis.range : std::min(most, axis.range);
  }
  if (force == 0) limits_.renders_force = false;
  if (force > 0 && (!profile.limits || force < limits_.max_force_n)) {
    // What is known of the motors' heat goes with their force.
    limits_.continuous_force_n *= force / limits_.max_force_n;
    limits_.max_force_n = force;
  }
  limits_.max_torque_nm = profile.limits && torque > 0 ? std::min(torque, limits_.max_torque_nm) : torque;
  max_bytes_ = std::max(force_.bytes, control_.bytes);
}

void ForceOutput::find_force_sample(const ReportDescriptor& descriptor) {
  for (const Field& field : descriptor.fields) {
    const int index = force_axis(field.usage);
    if (field.type != ReportType::kOutput || index < 0 || field.array() || field.bit_size > 32 ||
        !descriptor.within(field, u::kDownloadForceSample)) {
      continue;
    }
    if (!axes_.empty() && field.report_id != force_.id) continue;
    if (std::ranges::any_of(axes_, [&](const Axis& axis) { return axis.index == index; })) continue;
    const Conversion conversion = conversion_of(field);
    Axis axis{.field = field, .index = index};
    const auto end = static_cast<double>(field.logical_max);
    if (conversion.dimension == (index < 3 ? kNewtons : kNewtonMetres)) {
      axis.scale = conversion.scale;
      axis.offset = conversion.offset;
    } else if (const double full = index < 3 ? full_scale_ : limits_.max_torque_nm; full > 0 && end > 0) {
      axis.scale = full / end;
    } else {
      continue;
    }
    axis.range = std::abs(axis.scale * end + axis.offset);
    if (axis.scale == 0 || axis.range == 0) continue;
    axes_.push_back(axis);
    force_ = layout(descriptor, field);
  }
  if (!axes_.empty()) way_ = Way::kForceSample;
}

void ForceOutput::find_constant_force(const ReportDescriptor& descriptor) {
  const Writer constant(descriptor, ReportType::kOutput, u::kSetConstantForce);
  const Writer effect(descriptor, ReportType::kOutput, u::kSetEffect);
  const Writer operation(descriptor, ReportType::kOutput, u::kEffectOperationReport);
  const Writer create(descriptor, ReportType::kFeature, u::kCreateNewEffect);
  const Writer load(descriptor, ReportType::kFeature, u::kBlockLoad);
  const Field* magnitude = constant.find(u::kMagnitude);
  if (magnitude == nullptr || magnitude->logical_max <= 0 || constant.find(u::kEffectBlockIndex) == nullptr ||
      load.find(u::kEffectBlockIndex) == nullptr || !effect.exists() || !operation.exists() || !create.exists()) {
    return;
  }
  for (int index = 0; index < 3; ++index) {
    const bool enabled = effect.find(u::kX + static_cast<Usage>(index), u::kAxesEnable) != nullptr;
    if (!enabled && index > 0) continue;
    axes_.push_back({.field = *magnitude,
                     .index = index,
                     .range = full_scale_,
                     .scale = full_scale_ / static_cast<double>(magnitude->logical_max)});
  }
  if (const Field* duration = effect.find(u::kDuration); duration != nullptr) {
    const Conversion conversion = conversion_of(*duration);
    const double tick = conversion.dimension == kSeconds && conversion.scale > 0 ? conversion.scale : 1e-3;  // PID's
    const auto ticks = static_cast<std::int64_t>(std::floor(kEffectDuration / tick * (1 + 1e-9)));
    // Above the range, or all ones, is what PID calls infinite.
    if (ticks > 0 && ticks >= duration->logical_min && ticks <= duration->logical_max) {
      effect_ticks_ = ticks;
      effect_s_ = static_cast<double>(ticks) * tick;
    }
  }
  force_ = layout(descriptor, *magnitude);
  block_index_ = *constant.find(u::kEffectBlockIndex);
  way_ = Way::kConstantForce;
}

void ForceOutput::find_controls(const ReportDescriptor& descriptor) {
  for (std::size_t k = 0; k < kControlUsages.size(); ++k) {
    for (const Field& field : descriptor.fields) {
      if (field.type != ReportType::kOutput || !descriptor.within(field, u::kDeviceControl)) continue;
      std::optional<std::int64_t> value;
      if (field.array()) {
        value = descriptor.selector(field, kControlUsages[k]);
      } else if (field.usage == kControlUsages[k]) {
        value = 1;
      }
      if (!value) continue;
      controls_[k] = {.field = field, .value = *value, .known = true};
      control_ = layout(descriptor, field);
      break;
    }
  }
}

double ForceOutput::held_s() const {
  const double timeout = force_timeout_s_;
  if (way_ != Way::kConstantForce || effect_s_ == 0) return timeout;
  return timeout > 0 ? std::min(effect_s_, timeout) : effect_s_;
}

std::string ForceOutput::start(const ReportPort& port) {
  renewals_.clear();
  for (const ReportType type : {ReportType::kFeature, ReportType::kOutput}) {
    Writer gain(descriptor_, type, u::kDeviceGainReport);
    const Field* field = gain.find(u::kDeviceGain);
    if (!gain.put(field, field != nullptr ? field->logical_max : 0)) continue;
    if (!(type == ReportType::kFeature ? port.set_feature(gain.bytes()) : port.write(gain.bytes()))) {
      return "the device refuses its gain (PID Device Gain)";
    }
  }
  if (way_ != Way::kConstantForce) return {};

  std::vector<std::uint8_t> control(control_.bytes);
  if (const std::size_t size = encode(DeviceControl::kReset, control); size > 0) {
    if (!port.write(std::span(control).first(size))) return "the device refuses a reset (PID Device Control)";
  }
  for (Axis& axis : axes_) {
    Writer create(descriptor_, ReportType::kFeature, u::kCreateNewEffect);
    create.choose(u::kConstantForce, u::kEffectType);
    if (!port.set_feature(create.bytes())) return "the device makes no constant force (PID Create New Effect)";

    Writer load(descriptor_, ReportType::kFeature, u::kBlockLoad);
    const int size = port.get_feature(load.bytes());
    if (size < static_cast<int>(load.bytes().size())) return "the device gives no effect block (PID Block Load)";
    const auto data = std::span<const std::uint8_t>(load.bytes()).subspan(1);
    if (const Field* status = load.find(0, u::kBlockLoadStatus); status != nullptr && status->array()) {
      if (descriptor_.selected(*status, extract(data, *status)) != u::kBlockLoadSuccess) {
        return "the device has no room for an effect (PID Block Load)";
      }
    }
    axis.block = static_cast<std::uint8_t>(extract(data, *load.find(u::kEffectBlockIndex)));

    Writer effect(descriptor_, ReportType::kOutput, u::kSetEffect);
    effect.put(u::kEffectBlockIndex, axis.block);
    effect.choose(u::kConstantForce, u::kEffectType);
    effect.put(u::kDuration, effect_ticks_ > 0 ? effect_ticks_ : -1);  // all ones: for ever
    if (const Field* gain = effect.find(u::kEffectGain); gain != nullptr) effect.put(gain, gain->logical_max);
    effect.put(effect.find(u::kX + static_cast<Usage>(axis.index), u::kAxesEnable), 1);
    effect.put(u::kDirectionEnable, 1);
    // Clockwise from north, which is the far side: +X is east, +Y, the near side, is south.
    if (const Field* direction = effect.find(0, u::kDirection); direction != nullptr && axis.index < 2) {
      effect.put(direction, direction->logical_max / 4 * (axis.index + 1));
    }
    if (!port.write(effect.bytes())) return "the device refuses an effect (PID Set Effect)";

    Writer constant(descriptor_, ReportType::kOutput, u::kSetConstantForce);
    constant.put(u::kEffectBlockIndex, axis.block);
    if (!port.write(constant.bytes())) return "the device refuses a force (PID Set Constant Force)";

    Writer operation(descriptor_, ReportType::kOutput, u::kEffectOperationReport);
    operation.put(u::kEffectBlockIndex, axis.block);
    operation.choose(u::kEffectStart, u::kEffectOperation);
    operation.put(u::kLoopCount, 1);
    if (!port.write(operation.bytes())) return "the device does not start an effect (PID Effect Operation)";
    if (effect_ticks_ > 0) renewals_.push_back(operation.bytes());
  }
  return {};
}

int ForceOutput::report_count() const {
  if (way_ == Way::kNone) return 0;
  return way_ == Way::kForceSample ? 1 : static_cast<int>(axes_.size());
}

std::size_t ForceOutput::encode(int index, const Eigen::Vector3d& force, const Eigen::Vector3d& torque,
                                std::span<std::uint8_t> out) const noexcept {
  if (index < 0 || index >= report_count() || out.size() < force_.bytes) return 0;
  const std::span<std::uint8_t> report = out.first(force_.bytes);
  std::ranges::fill(report, std::uint8_t{0});
  report[0] = force_.id;
  const bool finite = force.allFinite() && torque.allFinite();
  const Eigen::Vector3d f = force_sign_ * (force_from_device_ * force);
  const Eigen::Vector3d t = force_sign_ * (torque_from_device_ * torque);
  const auto put = [&](const Axis& axis) {
    const double value = !finite ? 0 : axis.index < 3 ? f[axis.index] : t[axis.index - 3];
    const double logical = std::round((value - axis.offset) / axis.scale);
    const auto low = static_cast<double>(axis.field.logical_min);
    const auto high = static_cast<double>(axis.field.logical_max);
    insert(report.subspan(1), axis.field, static_cast<std::int64_t>(std::clamp(logical, low, high)));
  };
  if (way_ == Way::kForceSample) {
    for (const Axis& axis : axes_) put(axis);
  } else {
    put(axes_[index]);
    insert(report.subspan(1), block_index_, axes_[index].block);
  }
  return report.size();
}

std::size_t ForceOutput::encode(DeviceControl control, std::span<std::uint8_t> out) const noexcept {
  const Control& known = controls_[static_cast<std::size_t>(control)];
  if (!known.known || out.size() < control_.bytes) return 0;
  const std::span<std::uint8_t> report = out.first(control_.bytes);
  std::ranges::fill(report, std::uint8_t{0});
  report[0] = control_.id;
  insert(report.subspan(1), known.field, known.value);
  return report.size();
}

}  // namespace stylet::haptic::hid
