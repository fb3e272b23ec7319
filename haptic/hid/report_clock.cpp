#include "haptic/hid/report_clock.h"

#include <algorithm>
#include <cmath>

namespace stylet::haptic::hid {
namespace {

constexpr double kWrap = 65536;
constexpr double kDrift = 500e-6;   // of a cheap oscillator against ours: the smallest delay is forgotten so fast
constexpr double kDisagree = 10e6;  // ns; what has just come is not older
constexpr std::int64_t kPatience = 500'000'000;  // ns
constexpr double kPeriodShare = 0.02;            // of a new period in the mean

}  // namespace

ReportTime ReportClock::stamp(std::uint32_t scan_time, std::int64_t arrived_ns) {
  const std::uint32_t ticks = scan_time & 0xFFFF;
  ReportTime out{.made_ns = arrived_ns};
  if (!started_) {
    started_ = true;
    device_ns_ = 0;
    offset_ns_ = static_cast<double>(arrived_ns);
    period_ns_ = 0;
    steps_ = 0;
    agreed_ns_ = arrived_ns;
  } else {
    const double between = static_cast<double>((ticks - last_ticks_) & 0xFFFF) * tick_ns_;
    const double host = static_cast<double>(arrived_ns - last_arrived_ns_);
    // After a silence the clock may have gone round several times.
    const double wrap = kWrap * tick_ns_;
    const double rounds = std::max(0.0, std::round((host - between) / wrap));
    const double step = between + rounds * wrap;
    out.repeated = step <= 0;
    // A stamp from the future is a clock that was set, not a loss.
    const bool past = device_ns_ + step + offset_ns_ < static_cast<double>(arrived_ns) + kDisagree;
    if (step > 0) out.missing = learn_period(step, past);
    device_ns_ += step;
    offset_ns_ = std::min(offset_ns_ + kDrift * std::max(0.0, host), static_cast<double>(arrived_ns) - device_ns_);
    if (static_cast<double>(arrived_ns) - device_ns_ - offset_ns_ < kDisagree) {
      agreed_ns_ = arrived_ns;
    } else if (arrived_ns - agreed_ns_ > kPatience) {
      offset_ns_ = static_cast<double>(arrived_ns) - device_ns_;
    }
    out.made_ns = static_cast<std::int64_t>(device_ns_ + offset_ns_);
  }
  last_ticks_ = ticks;
  last_arrived_ns_ = arrived_ns;
  return out;
}

std::uint64_t ReportClock::learn_period(double step, bool past) {
  if (steps_ < kFirstSteps) {
    first_steps_[steps_++] = step;
    if (steps_ == kFirstSteps) {
      const auto middle = first_steps_.begin() + kFirstSteps / 2;
      std::nth_element(first_steps_.begin(), middle, first_steps_.end());
      period_ns_ = *middle;
    }
    return 0;
  }
  if (step > 1.5 * period_ns_) return past ? static_cast<std::uint64_t>(std::llround(step / period_ns_)) - 1 : 0;
  period_ns_ += kPeriodShare * (step - period_ns_);
  return 0;
}

}  // namespace stylet::haptic::hid
