#include "tests/support/hid/pid_stick.h"

#include <algorithm>
#include <cerrno>

namespace stylet::support {
namespace {

// Report ids, as in the example of PID 1.0, appendix.
constexpr std::uint8_t kInput = 1;
constexpr std::uint8_t kSetEffect = 1;
constexpr std::uint8_t kSetConstantForce = 5;
constexpr std::uint8_t kEffectOperation = 10;
constexpr std::uint8_t kDeviceControl = 12;
constexpr std::uint8_t kCreateNewEffect = 17;
constexpr std::uint8_t kBlockLoad = 18;
constexpr std::uint16_t kLongest = 0x7FFF;  // ms; what is more is for ever

int u16(std::span<const std::uint8_t> report, std::size_t at) {
  return report[at] | report[at + 1] << 8;
}

}  // namespace

std::vector<std::uint8_t> PidStick::descriptor() const {
  std::vector<std::uint8_t> bytes{
      0x05, 0x01,   0x09, 0x04, 0xA1,       0x01,              // Joystick
      0x85, kInput, 0x09, 0x01, 0xA1,       0x00,              //   Pointer
      0x09, 0x30,   0x09, 0x31, 0x16,       0x01, 0x80, 0x26,  //     X, Y: 16 bits
      0xFF, 0x7F,   0x75, 0x10, 0x95,       0x02, 0x81, 0x02, 0xC0, 0x05, 0x0F, 0x09,
      0x21, 0xA1,   0x02, 0x85, kSetEffect,                                            //   Set Effect Report
      0x09, 0x22,   0x15, 0x01, 0x25,       0x28, 0x75, 0x08, 0x95, 0x01, 0x91, 0x02,  // Effect Block Index
      0x09, 0x25,   0xA1, 0x02, 0x09,       0x26, 0x25, 0x01, 0x91, 0x00, 0xC0};       // Effect Type: Constant Force
  const auto add = [&](std::initializer_list<std::uint8_t> more) { bytes.insert(bytes.end(), more); };
  if (!endless_) {
    add({0x09, 0x50, 0x15, 0x00, 0x26, 0xFF, 0x7F, 0x35, 0x00, 0x46, 0xFF, 0x7F, 0x66, 0x03,
         0x10, 0x55, 0x0D, 0x75, 0x10, 0x91, 0x02, 0x45, 0x00, 0x65, 0x00, 0x55, 0x00});  // Duration, ms
  }
  add({0x05, 0x0F, 0x09, 0x55, 0xA1, 0x02, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31,
       0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x02, 0x91, 0x02, 0xC0});              // Axes Enable: X, Y
  add({0x05, 0x0F, 0x09, 0x56, 0x95, 0x01, 0x91, 0x02, 0x95, 0x05, 0x91, 0x03, 0xC0});  // Direction Enable
  add({0x09, 0x73, 0xA1, 0x02, 0x85, kSetConstantForce,                                 // Set Constant Force Report
       0x09, 0x22, 0x15, 0x01, 0x25, 0x28,
       0x75, 0x08, 0x95, 0x01, 0x91, 0x02,  // Effect Block Index
       0x09, 0x70, 0x16, 0x01, 0x80, 0x26,
       0xFF, 0x7F, 0x75, 0x10, 0x91, 0x02,
       0xC0});                                          // Magnitude
  add({0x09, 0x77, 0xA1, 0x02, 0x85, kEffectOperation,  // Effect Operation Report
       0x09, 0x22, 0x15, 0x01, 0x25, 0x28,
       0x75, 0x08, 0x91, 0x02,  // Effect Block Index
       0x09, 0x78, 0xA1, 0x02, 0x09, 0x79,
       0x09, 0x7A, 0x09, 0x7B, 0x25, 0x03,
       0x91, 0x00, 0xC0,  // Start, Solo, Stop
       0x09, 0x7C, 0x15, 0x00, 0x26, 0xFF,
       0x00, 0x91, 0x02, 0xC0});  // Loop Count
  add({0x09, 0x95, 0xA1, 0x02, 0x85, kDeviceControl, 0x09, 0x96, 0xA1, 0x02, 0x09, 0x97, 0x09,
       0x98, 0x09, 0x99, 0x09, 0x9A, 0x15,           0x01, 0x25, 0x04, 0x91, 0x00, 0xC0, 0xC0});  // Device Control
  add({0x09, 0xAB, 0xA1, 0x02, 0x85, kCreateNewEffect, 0x09, 0x25, 0xA1, 0x02, 0x09, 0x26, 0x25, 0x01, 0xB1, 0x00,
       0xC0, 0xC0});                                                                  // Create New Effect Report
  add({0x09, 0x89, 0xA1, 0x02, 0x85, kBlockLoad, 0x09, 0x22, 0x25, 0x28, 0xB1, 0x02,  // Block Load Report
       0x09, 0x8B, 0xA1, 0x02, 0x09, 0x8C,       0x09, 0x8D, 0x09, 0x8E, 0x25, 0x03, 0xB1, 0x00, 0xC0, 0xC0, 0xC0});
  return bytes;
}

std::size_t PidStick::input(std::int64_t /*now_ns*/, std::span<std::uint8_t> report) {
  std::fill_n(report.begin(), 5, std::uint8_t{0});
  report[0] = kInput;
  report[1] = static_cast<std::uint8_t>(++reports_ % 2);  // its sensor's noise
  return 5;
}

int PidStick::output(std::int64_t now_ns, std::span<const std::uint8_t> report) {
  tick(now_ns);
  last_report_ns_ = now_ns;
  if (report[0] == kDeviceControl) {
    if (report[1] == 1) enabled_ = true;
    if (report[1] == 2) enabled_ = false;
    if (report[1] == 4) effects_.clear();
    return 0;
  }
  if (report[1] == 0 || report[1] > effects_.size()) return EINVAL;
  Effect& effect = effects_[report[1] - 1U];
  switch (report[0]) {
    case kSetEffect: {
      const std::uint8_t axes = report[endless_ ? 3 : 5];
      const int duration_ms = endless_ ? 0 : u16(report, 3);
      effect.duration_ns = duration_ms > kLongest ? 0 : duration_ms * std::int64_t{1'000'000};
      effect.axis = (axes & 3) == 1 ? 0 : (axes & 3) == 2 ? 1 : -1;
      return 0;
    }
    case kSetConstantForce:
      effect.magnitude = static_cast<std::int16_t>(u16(report, 2)) / 32767.0;
      return 0;
    case kEffectOperation:
      effect.plays = report[2] == 1;
      effect.started_ns = now_ns;
      ++starts_;
      return 0;
    default:
      return EINVAL;
  }
}

int PidStick::set_feature(std::int64_t /*now_ns*/, std::span<const std::uint8_t> report) {
  if (report[0] != kCreateNewEffect || report[1] != 1) return EINVAL;
  effects_.emplace_back();
  return 0;
}

int PidStick::get_feature(std::span<std::uint8_t> report) {
  if (report[0] != kBlockLoad || report.size() < 3) return -EINVAL;
  report[1] = static_cast<std::uint8_t>(effects_.size());
  report[2] = 1;  // success
  return 3;
}

void PidStick::tick(std::int64_t now_ns) {
  for (Effect& effect : effects_) {
    if (!effect.plays || effect.duration_ns == 0 || now_ns < effect.started_ns + effect.duration_ns) continue;
    effect.plays = false;
    ran_out_ns_ = effect.started_ns + effect.duration_ns;
    ++times_run_out_;
  }
}

void PidStick::power_off() {
  effects_.clear();
  enabled_ = false;
}

double PidStick::applied(int axis) const {
  double sum = 0;
  for (const Effect& effect : effects_) {
    if (enabled_ && effect.plays && effect.axis == axis) sum += effect.magnitude;
  }
  return sum;
}

}  // namespace stylet::support
