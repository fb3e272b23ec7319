// The frame-interpolated state buffer: the simulation publishes time-stamped states at its own pace, pictures ask for
// the world at any time.
#pragma once

#include "engine/state/frame_state.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stylet::state {

/// How a sampled state was made, and from which published ones.
struct FrameStamps {
  Provenance provenance = Provenance::none;
  double earlier_s = 0;            ///< time of the state at or before the one asked for
  double later_s = 0;              ///< time of the state at or after it; the same when exact or held
  std::uint64_t earlier_step = 0;  ///< their simulation steps
  std::uint64_t later_step = 0;
};

/// A ring of the last published states. One writer thread, any number of reader threads. The writer never waits and
/// never retries; a reader copies what it needs and starts again if the writer overtook it, so nothing it returns is
/// torn. No allocation after construction. Every shared word is an atomic (a sequence lock a slot), so there is no
/// data race even where a copy is thrown away.
///
/// Positions, force and scalars are interpolated linearly, orientations by slerp. For a motion of acceleration at
/// most a, published every h seconds, the error of a position is at most a h^2 / 8.
class StateBuffer {
public:
  static constexpr int kMinHistory = 4;

  /// @param prototype  has the array sizes of all states to come
  /// @param history    states kept, at least kMinHistory; the oldest two are not offered to readers, so that the
  ///                   writer has to publish twice during one copy to disturb it
  explicit StateBuffer(const FrameState& prototype, int history = 8);

  /// Writer: makes a state known. Sizes as the prototype (checked: a mismatch is a bug and aborts).
  /// @return false, and nothing happens, when the time is not finite or not later than the last one published
  /// @realtime no allocation, no lock; O(words of the state)
  bool publish(const FrameState& state);

  /// Reader: the world at `time_s`, written to `out` (sized as the prototype; make one with make_frame()).
  /// Between two published states: interpolated, out.time_s is the time asked for and the step counts are the earlier
  /// state's. Outside: the nearest one, held, with its own time. Before the first publish: none, `out` is untouched.
  /// Any thread; lock-free, never delays the writer.
  FrameStamps sample(double time_s, FrameState& out) const;

  /// A FrameState with the array sizes of the prototype.
  FrameState make_frame() const { return prototype_; }
  /// Time of the newest state, minus infinity before the first. Any thread.
  double newest_s() const { return newest_s_.load(std::memory_order_acquire); }

private:
  struct Slot {
    std::atomic<std::uint64_t> sequence{0};  // 2n - 1 while publication n (from 1) is written, 2n when it is whole
    std::atomic<double> time_s{0};
    std::atomic<std::uint64_t> simulation_step{0};
    std::atomic<std::uint64_t> haptic_step{0};
    std::vector<std::atomic<float>> values;  // [value_count_] in the order of for_each_value()
  };

  Slot& slot(std::uint64_t publication) { return slots_[publication % slots_.size()]; }
  const Slot& slot(std::uint64_t publication) const { return slots_[publication % slots_.size()]; }
  bool try_sample(double time_s, FrameState& out, FrameStamps& stamps) const;

  FrameState prototype_;
  std::vector<Slot> slots_;
  std::atomic<std::uint64_t> published_{0};
  std::atomic<double> newest_s_;
};

}  // namespace stylet::state
