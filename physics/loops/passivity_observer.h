// Watches the work of the hand for energy that nobody put in: over a sliding window, and over each closed cycle of
// the hub. The least of all time since the start (NeedleState::hand_work) is blind after the first insertion: what
// cutting and friction took by then covers whatever comes back later.
#pragma once

#include "physics/messages/messages.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace stylet::physics {

struct PassivitySettings {
  double window_s = 1;         ///< length of the sliding window
  double step_s = 1e-3;        ///< of the haptic loop; the window holds window_s / step_s steps
  double reversal = 5e-4;      ///< the hub must come back by so much for a reversal of its way to count, m
  double least_stroke = 1e-3;  ///< of a cycle, m
  double most_gap = 2e-3;      ///< where a cycle ends off where it began, m; what is left is closed at constant force
  double most_turned = 0.05;   ///< and of the hub's orientation, rad
};

/// Work of the hand on the needle over an interval of time. Negative: the hand got energy back.
struct WatchedWork {
  double work = 0;  ///< J
  double from_s = 0;
  double to_s = 0;
  double stroke = 0;      ///< of a cycle: of the hub along the needle, m
  double peak_force = 0;  ///< of a cycle: on the hand, N
  /// The cycle's work over the largest that it could have been, -.
  double share() const { return stroke * peak_force > 0 ? work / (stroke * peak_force) : 0; }
};

/// Of all that was seen so far.
struct PassivitySummary {
  double window_s = 0;
  WatchedWork least_window{};  ///< also windows that are not yet full; 0 long: nothing came back in any
  std::uint64_t cycles = 0;    ///< closed
  std::uint64_t open = 0;      ///< came back to their depth, but elsewhere or turned, so that nothing can be said
  WatchedWork least_cycle{};   ///< with cycles > 0
};

/// A cycle begins where the hub's way along the needle turns round and ends where it is back there, as rain-flow
/// counting pairs reversals (ASTM E 1049), small cycles within large ones each for itself. A closed cycle in tissue
/// that is itself back where it was may give the hand nothing, with cutting and friction it must take. A window says
/// less: it may give back what was stored before. Neither knows of other hands: breathing, and a probe, do work too.
/// Memory is constant. Haptic thread.
class PassivityObserver {
public:
  explicit PassivityObserver(const PassivitySettings& settings = {});

  /// After each haptic step.
  /// @param hub  as the step was given it
  /// @realtime   no allocation; O(1) on average, O(kReversals) at most
  void add(double time_s, const StylusPose& hub, const NeedleState& needle);

  const PassivitySummary& summary() const { return summary_; }

private:
  static constexpr std::size_t kReversals = 64;

  /// A moment of the hub's way.
  struct Mark {
    double time_s = 0;
    double way = 0;   // along the needle, m
    double work = 0;  // of the hand, J
    StylusPose hub{};
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  // on the hand, N
    double peak_force = 0;                            // from here on, N
  };

  void slide(const Mark& now);
  void close(const Mark& begin, const Mark& turn, const Mark& end);
  void close_passed(const Mark& now);
  void turn_round(const Mark& now);

  PassivitySettings settings_;
  PassivitySummary summary_;
  std::vector<std::array<double, 2>> window_;  // ring of time and work
  std::uint64_t steps_ = 0;
  Mark last_{};
  int direction_ = 0;                         // of the way: 1 in, -1 out, 0 not known yet
  Mark farthest_{};                           // in that direction since the last reversal
  std::array<Mark, kReversals> reversals_{};  // oldest first; a new one beyond the last place pushes out the oldest
  std::size_t reversal_count_ = 0;
};

}  // namespace stylet::physics
