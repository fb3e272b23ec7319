// How long the stages of a haptic step take: filled in by HapticLoop where a bench asks for it.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace stylet::physics {

/// Stages of HapticLoop::step() in the order of Table I of the paper.
enum class HapticStage {
  synchronisation,    ///< a new tissue patch taken in: only in steps that see a new epoch
  free_motion,        ///< needle follows the hub; beams' forces and stiffness; free motion
  needle_factor,      ///< factorisation of A_n, where the paper forms A_n^-1
  contact_positions,  ///< tissue points projected on the shaft
  contact_directions,
  contact_rows,  ///< H_n^T, H_v
  delta_free,
  delassus,  ///< W_n, W_v
  solve,
  correction,  ///< needle and isolated DOFs
  force,       ///< at the base
  publication  ///< NeedleState
};
inline constexpr std::size_t kHapticStages = 12;

/// Durations of the last step, by stage.
class HapticStageClock {
public:
  using Clock = std::chrono::steady_clock;

  void start() {
    times_.fill(Clock::duration::zero());
    last_ = Clock::now();
  }
  /// The time since the last mark (or the start) was spent in this stage.
  void mark(HapticStage stage) {
    const auto now = Clock::now();
    times_[static_cast<std::size_t>(stage)] += now - last_;
    last_ = now;
  }
  Clock::duration time(HapticStage stage) const { return times_[static_cast<std::size_t>(stage)]; }

private:
  Clock::time_point last_;
  std::array<Clock::duration, kHapticStages> times_{};
};

}  // namespace stylet::physics
