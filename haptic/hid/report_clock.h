// How old a report is: the device's own clock held against the host's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace stylet::haptic::hid {

/// What the time stamp of a report tells.
struct ReportTime {
  std::int64_t made_ns = 0;   ///< host clock, when the device made it
  std::uint64_t missing = 0;  ///< reports that should have come since the last one
  bool repeated = false;      ///< its stamp is that of the last one: the device's clock stands still
};

/// Maps Scan Time (ticks of the device's clock, modulo 2^16) to the host's clock by the smallest delay seen: what was
/// queued shows as a larger one. Where all reports look old for half a second the device's clock had stood still, and
/// the mapping is learnt anew. What is missing is told once the period is known, as the median of the first steps:
/// what a device had ready before anybody listened comes in its own rhythm. Depends on its inputs only.
class ReportClock {
public:
  /// @param tick_s    of Scan Time, s
  explicit ReportClock(double tick_s = 1e-4) : tick_ns_(tick_s * 1e9) {}

  /// @param scan_time   of the report
  /// @param arrived_ns  host clock when it was read
  ReportTime stamp(std::uint32_t scan_time, std::int64_t arrived_ns);
  void reset() { started_ = false; }

private:
  /// @return reports that should have come in a step of the device's clock
  std::uint64_t learn_period(double step, bool past);

  static constexpr std::size_t kFirstSteps = 9;
  double tick_ns_;
  bool started_ = false;
  std::uint32_t last_ticks_ = 0;
  std::int64_t last_arrived_ns_ = 0;
  std::int64_t agreed_ns_ = 0;  // when a report last looked as new as one that has just come
  double device_ns_ = 0;        // the device's clock, not wrapped
  double offset_ns_ = 0;        // host minus device, smallest delay
  double period_ns_ = 0;        // between reports, smoothed; 0: not known yet
  std::size_t steps_ = 0;
  std::array<double, kFirstSteps> first_steps_{};
};

}  // namespace stylet::haptic::hid
