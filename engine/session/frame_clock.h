// Pictures at a fixed rate out of a session, whatever the rate of its loops.
#pragma once

#include "engine/session/frame_publisher.h"

#include <functional>
#include <limits>

namespace stylet::session {

struct FrameClockSettings {
  double frames_per_second = 30;
  double from_s = 0;
  double to_s = std::numeric_limits<double>::infinity();
};

/// Asks the state buffer for the world at each frame's time, as soon as a later state is known. For lockstep and
/// replay, where time waits for the pictures; stands after the FramePublisher among the listeners. Simulation thread.
class FrameClock final : public StepListener {
public:
  /// @param draw  gets the number of the frame, from 0, and the interpolated state at its time
  using Draw = std::function<void(int frame, const state::FrameState& state)>;
  FrameClock(const FramePublisher& publisher, const FrameClockSettings& settings, Draw draw)
      : buffer_(publisher.buffer()), settings_(settings), draw_(std::move(draw)), frame_(buffer_.make_frame()) {}

  void simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport&,
                          const physics::TissueState&, const physics::NeedleState&) override {
    for (double time_s = next_s(); time_s <= buffer_.newest_s() && time_s <= settings_.to_s; time_s = next_s()) {
      buffer_.sample(time_s, frame_);
      draw_(frames_++, frame_);
    }
  }
  int frames() const { return frames_; }

private:
  double next_s() const { return settings_.from_s + frames_ / settings_.frames_per_second; }

  const state::StateBuffer& buffer_;
  FrameClockSettings settings_;
  Draw draw_;
  state::FrameState frame_;
  int frames_ = 0;
};

}  // namespace stylet::session
