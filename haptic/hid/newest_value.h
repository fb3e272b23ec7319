// Carries the newest value from one thread to another without a lock; the older ones are lost.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace stylet::haptic::hid {

/// One writer, one reader; neither waits, retries or allocates. What physics::LatestValue is for large messages, for
/// small values that are copied: this room and that one know nothing of each other.
/// @realtime both sides: one atomic exchange
template <typename T>
class NewestValue {
public:
  /// Writer.
  void put(const T& value) {
    slots_[back_] = value;
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
  }
  /// Reader: takes over a newer value. @return whether there was one
  bool update() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  /// Reader: the value of the last update().
  const T& get() const { return slots_[front_]; }

private:
  static constexpr std::uint32_t kFresh = 4;
  static constexpr std::uint32_t kIndex = 3;
  std::array<T, 3> slots_{};
  alignas(64) std::atomic<std::uint32_t> middle_{1};
  alignas(64) std::uint32_t back_ = 0;   // writer's
  alignas(64) std::uint32_t front_ = 2;  // reader's
};

}  // namespace stylet::haptic::hid
