#include "haptic/latency_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace stylet::haptic {

// Durations below 2^kSubBits ns have a bucket each; above, the leading kSubBits + 1 bits choose the bucket.
std::size_t LatencyHistogram::bucket(std::uint64_t ns) {
  constexpr std::uint64_t sub = 1u << kSubBits;
  if (ns < sub) return ns;
  const int shift = static_cast<int>(std::bit_width(ns)) - (kSubBits + 1);
  return (static_cast<std::size_t>(shift) << kSubBits) + static_cast<std::size_t>(ns >> shift);
}

double LatencyHistogram::middle_ns(std::size_t bucket) {
  constexpr std::size_t sub = 1u << kSubBits;
  if (bucket < sub) return static_cast<double>(bucket);
  const auto shift = static_cast<int>(bucket >> kSubBits) - 1;
  const auto leading = static_cast<double>(sub + (bucket & (sub - 1)));
  return std::ldexp(leading + 0.5, shift) - 0.5;
}

void LatencyHistogram::add(std::int64_t duration_ns) {
  const std::int64_t ns = std::max<std::int64_t>(duration_ns, 0);
  // One writer: a load and a store are enough, no locked instruction.
  auto& slot = buckets_[bucket(static_cast<std::uint64_t>(ns))];
  slot.store(slot.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (ns > max_ns_.load(std::memory_order_relaxed)) max_ns_.store(ns, std::memory_order_relaxed);
  count_.store(count_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

double LatencyHistogram::quantile(double fraction) const {
  const std::uint64_t total = count();
  if (total == 0) return 0;
  const double max_ns = static_cast<double>(max_ns_.load(std::memory_order_relaxed));
  const double wanted = std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(total));
  if (wanted >= static_cast<double>(total)) return 1e-9 * max_ns;
  std::uint64_t seen = 0;
  for (std::size_t b = 0; b < kBuckets; ++b) {
    seen += buckets_[b].load(std::memory_order_relaxed);
    if (seen > 0 && static_cast<double>(seen) >= wanted) return 1e-9 * std::min(middle_ns(b), max_ns);
  }
  return 1e-9 * max_ns;
}

LatencyQuantiles LatencyHistogram::quantiles() const {
  return {.median_s = quantile(0.5), .p90_s = quantile(0.9), .p99_s = quantile(0.99), .max_s = quantile(1.0)};
}

}  // namespace stylet::haptic
