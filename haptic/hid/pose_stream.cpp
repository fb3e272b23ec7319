#include "haptic/hid/pose_stream.h"

#include <utility>

namespace stylet::haptic::hid {
namespace {

void count(std::atomic<std::uint64_t>& counter, std::uint64_t more = 1) {
  counter.fetch_add(more, std::memory_order_relaxed);
}

}  // namespace

PoseStream::PoseStream(const StylusMap& map, StreamCounters& counters, double silence_s, std::uint64_t gaps)
    : map_(map),
      counters_(counters),
      silence_ns_(static_cast<std::int64_t>(silence_s * 1e9)),
      clock_(map.scan_tick_s() > 0 ? map.scan_tick_s() : 1e-4),
      latest_{.gaps = gaps} {}

void PoseStream::add(std::span<const std::uint8_t> report, std::int64_t arrived_ns) {
  ++queued_;
  count(counters_.reports);
  const Decoded decoded = map_.decode(report, reading_);
  count(counters_.decoded[static_cast<std::size_t>(decoded)]);
  if (decoded != Decoded::kReading) return;
  ReportTime time{.made_ns = arrived_ns};
  if ((reading_.carries & kScanTime) != 0) time = clock_.stamp(reading_.scan_time, arrived_ns);
  count(counters_.missing, time.missing);
  if (time.repeated) {
    count(counters_.repeated);  // the device's clock stands still: it is not alive
    return;
  }
  made_ns_ = time.made_ns;
  fresh_ = true;
}

bool PoseStream::end(std::int64_t looked_ns) {
  const std::int64_t not_before_ns = std::exchange(empty_ns_, looked_ns);
  const std::size_t queued = queued_;
  const bool fresh = fresh_;
  queued_ = 0;
  fresh_ = false;
  if (silence_ns_ > 0 && !placed_) {
    placed_ = fresh;
    return false;
  }
  const bool waited = silence_ns_ > 0 && looked_ns - not_before_ns > silence_ns_;
  if (queued >= kFullQueue || (fresh && (waited || looked_ns - made_ns_ > kMostAge))) {
    count(counters_.discarded, queued);
    gap_ = true;
    return false;
  }
  if (!fresh) return false;
  if (latest_.connected && silence_ns_ > 0 && made_ns_ - latest_.made_ns > silence_ns_) gap_ = true;
  latest_ = {.reading = reading_,
             .made_ns = made_ns_,
             .not_before_ns = not_before_ns,
             .gaps = latest_.gaps + (gap_ ? 1 : 0),
             .connected = true};
  if (gap_) count(counters_.gaps);
  gap_ = false;
  return true;
}

}  // namespace stylet::haptic::hid
