// Lock-free latest-value buffer between one writer and one reader (triple buffer).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace stylet::physics {

/// One writer thread, one reader thread; neither ever waits, retries or allocates, and a value is never torn.
/// The writer fills back() and calls publish(); the reader calls update() and reads front(). A value that the reader
/// did not fetch before the next publish is lost: only the latest counts.
/// @realtime both sides: one atomic exchange
template <typename T>
class LatestValue {
public:
  LatestValue() = default;
  /// Fills all three slots with copies of `initial`, so that arrays inside T are sized before the loops start.
  explicit LatestValue(const T& initial) : slots_{initial, initial, initial} {}
  /// Fills all three slots with what `make` returns, one call each.
  template <typename Make>
  requires std::is_invocable_r_v<T, Make>
  explicit LatestValue(Make&& make) : slots_{make(), make(), make()} {}
  LatestValue(const LatestValue&) = delete;
  LatestValue& operator=(const LatestValue&) = delete;

  /// Writer: the slot to fill. Holds an older value, not the last one published.
  T& back() { return slots_[back_]; }
  /// Writer: makes back() the latest value.
  void publish() { back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }
  /// Reader: takes the latest value if there is a newer one; true if front() changed.
  bool update() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  /// Reader: the value taken by the last update(). Its own until the next: it may add to it.
  T& front() { return slots_[front_]; }
  const T& front() const { return slots_[front_]; }

private:
  static constexpr std::uint32_t kFresh = 4;
  static constexpr std::uint32_t kIndex = 3;
  std::array<T, 3> slots_{};
  alignas(64) std::atomic<std::uint32_t> middle_{1};
  alignas(64) std::uint32_t back_ = 0;   // writer's
  alignas(64) std::uint32_t front_ = 2;  // reader's
};

}  // namespace stylet::physics
