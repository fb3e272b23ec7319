// What a session looked like at any time, kept in memory: seeking through a replay takes no physics.
#pragma once

#include "engine/state/frame_state.h"

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

namespace stylet::debrief {

/// Frames of a session in ascending order of time. Nodes of bodies are kept as 16-bit parts of the largest
/// displacement of their frame (0.5 um of 30 mm), the rest as it is: 30 kB a frame of 4500 nodes. Where the memory is
/// used up, every other frame goes and from then on half as many come. Any thread.
class FrameHistory {
public:
  static constexpr std::size_t kMemory = std::size_t{512} << 20;

  /// @param rest    the sizes of all frames, and where the nodes are displaced from
  /// @param memory  bytes that the frames take at most
  explicit FrameHistory(const state::FrameState& rest, std::size_t memory = kMemory);

  /// A frame that is not later than the last one is left out.
  void add(const state::FrameState& frame);
  /// The world at a time, between two frames interpolated, outside the nearest one. @param[out] out  sized as `rest`
  /// @return false while there is no frame
  bool sample(double time_s, state::FrameState& out) const;

  state::FrameState make_frame() const { return rest_; }
  std::size_t size() const;
  double begin_s() const;  ///< 0 while there is no frame
  double end_s() const;

private:
  struct Kept {
    state::FrameDetails details;
    float metres_per_unit = 0;
    std::vector<std::int16_t> nodes;  ///< [3 * nodes of all bodies] displacements
  };
  Kept pack(const state::FrameState& frame) const;
  void unpack(const Kept& kept, state::FrameState& out) const;
  /// Whether a frame of this time is later than the last one.
  bool is_next(double time_s) const { return frames_.empty() || time_s > frames_.back().details.time_s; }

  state::FrameState rest_;
  std::size_t most_frames_;
  mutable std::mutex mutex_;
  std::vector<Kept> frames_;
  std::uint64_t seen_ = 0;
  std::uint64_t every_ = 1;
};

}  // namespace stylet::debrief
