// Durations counted in buckets, so that a running loop can be asked for its median and its tail at any time.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace stylet::haptic {

/// Quantiles of a set of durations, s. Within 1/64 of the true value, max exact.
struct LatencyQuantiles {
  double median_s = 0;
  double p90_s = 0;
  double p99_s = 0;
  double max_s = 0;
};

/// Log-linear buckets: 32 to each power of two of nanoseconds. One thread adds, any thread reads; a reading made
/// while the other thread adds is of a moment within the reading.
class LatencyHistogram {
public:
  /// Negative durations count as 0. @realtime no allocation, a handful of instructions
  void add(std::int64_t duration_ns);
  /// Smallest duration not exceeded by `fraction` (0..1] of the samples, s; 0 when there are none.
  double quantile(double fraction) const;
  LatencyQuantiles quantiles() const;
  std::uint64_t count() const { return count_.load(std::memory_order_relaxed); }

private:
  static constexpr int kSubBits = 5;
  static constexpr std::size_t kBuckets = std::size_t{64 - kSubBits} << kSubBits;
  static std::size_t bucket(std::uint64_t ns);
  static double middle_ns(std::size_t bucket);

  std::array<std::atomic<std::uint64_t>, kBuckets> buckets_{};
  std::atomic<std::uint64_t> count_{0};
  std::atomic<std::int64_t> max_ns_{0};
};

}  // namespace stylet::haptic
