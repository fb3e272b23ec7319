// Who makes the steps of the loops, and when: threads in real time, or one caller on a fixed schedule.
#pragma once

#include "engine/session/run_statistics.h"

#include <cstdint>

namespace stylet::session {

/// A run under way. One thread, but where it says otherwise; what the loops use is theirs until stop().
class Schedule {
public:
  virtual ~Schedule() = default;
  /// Makes the steps of so much more session time, s; while paused, lets the force fade so long. Nothing where
  /// threads make them by themselves.
  virtual void advance(double by_s) = 0;
  /// Session time, from the start without the pauses, s. Any thread.
  virtual double time_s() const = 0;
  /// Session time when CLOCK_MONOTONIC read so, ns: s, negative before the start. In lockstep clocks mean nothing,
  /// and all was before. The thread of pause().
  virtual double time_of(std::int64_t clock_ns) const = 0;
  /// Session time stands still, the loops make no step, the force fades out. A second call of either does nothing.
  virtual void pause() = 0;
  virtual void resume() = 0;
  /// Any thread.
  virtual bool paused() const = 0;
  /// StylusStep::click().
  virtual void click() = 0;
  /// The duration has passed. Any thread.
  virtual bool finished() const = 0;
  /// No step is made any more; zero force goes to the device. May be called twice.
  virtual void stop() = 0;
  /// After stop().
  virtual RunStatistics statistics() const = 0;
};

}  // namespace stylet::session
