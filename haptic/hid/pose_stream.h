// Reports as they come made into poses that may be trusted: of a queue the newest, and nothing that waited.
#pragma once

#include "haptic/hid/report_clock.h"
#include "haptic/hid/stylus_map.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

namespace stylet::haptic::hid {

/// What is known of the hand.
struct StreamedPose {
  HidReading reading{};
  std::int64_t made_ns = 0;  ///< host clock, when the device made it, as far as the device's clock can be believed
  /// Host clock: it was not in the queue yet, whatever the device's clock says. So it is no older than from then.
  std::int64_t not_before_ns = 0;
  std::uint64_t gaps = 0;  ///< so far: where it changes, the hand was not followed in between
  bool connected = false;
};

/// Any thread may read them.
struct StreamCounters {
  std::atomic<std::uint64_t> reports{0};                            ///< that came in
  std::array<std::atomic<std::uint64_t>, kDecodedCount> decoded{};  ///< what became of them, by Decoded
  std::atomic<std::uint64_t> missing{0};                            ///< that never came, by their Scan Time
  std::atomic<std::uint64_t> repeated{0};                           ///< with the Scan Time of the one before
  std::atomic<std::uint64_t> discarded{0};                          ///< that had waited too long
  std::atomic<std::uint64_t> gaps{0};                               ///< times the hand was taken up again
};

/// The kernel's queue of a device has room for 63 reports and drops what comes when it is full. So a reader that was
/// kept away finds old poses, the newest of them too: a queue that was full, or whose newest report is older than
/// kMostAge by its Scan Time, is discarded whole, and the first report after it counts. Scan Time only makes a pose
/// older: where a device may not be silent so long as the queue was not looked at, how long its reports had waited
/// nothing tells, and they are discarded too; so is the very first queue. Depends on its inputs only.
class PoseStream {
public:
  static constexpr std::size_t kFullQueue = 63;
  static constexpr std::int64_t kMostAge = 10'000'000;  ///< ns

  /// @param map, counters  outlive it
  /// @param silence_s      without a report is a gap; 0: the device may be silent while nothing moves
  /// @param gaps           before
  PoseStream(const StylusMap& map, StreamCounters& counters, double silence_s, std::uint64_t gaps = 0);

  /// A report of the queue, in order. @param arrived_ns  host clock
  void add(std::span<const std::uint8_t> report, std::int64_t arrived_ns);
  /// The queue was empty. @param looked_ns  host clock, before the look that found it so; a report that comes later
  /// was made later. @return whether there is a new pose, in latest()
  bool end(std::int64_t looked_ns);

  const StreamedPose& latest() const { return latest_; }

private:
  const StylusMap& map_;
  StreamCounters& counters_;
  std::int64_t silence_ns_;
  ReportClock clock_;
  HidReading reading_;  // after the last report, trusted or not
  std::int64_t made_ns_ = 0;
  std::int64_t empty_ns_ = 0;  // when the queue was seen empty last
  std::size_t queued_ = 0;
  bool fresh_ = false;   // something of the queue is newer than what was published
  bool placed_ = false;  // there was a first queue, which places the device's clock
  bool gap_ = false;     // since the last pose published
  StreamedPose latest_;
};

}  // namespace stylet::haptic::hid
