// Every report of a session, as it came in.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace stylet::haptic::hid {

struct LoggedReport {
  std::int64_t arrived_ns = 0;  ///< CLOCK_MONOTONIC
  std::vector<std::uint8_t> bytes;
};

/// The reader of a stylus adds, which may allocate; anyone takes.
class ReportLog {
public:
  void add(std::int64_t arrived_ns, std::span<const std::uint8_t> report) {
    const std::scoped_lock lock(mutex_);
    reports_.push_back({arrived_ns, {report.begin(), report.end()}});
  }
  /// What was added so far, in order; it is empty afterwards.
  std::deque<LoggedReport> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(reports_, {});
  }

private:
  std::mutex mutex_;
  std::deque<LoggedReport> reports_;
};

}  // namespace stylet::haptic::hid
