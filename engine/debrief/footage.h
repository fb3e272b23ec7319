// What a debrief is made from: a session as it was kept while it ran, or as its replay made it anew.
#pragma once

#include "engine/debrief/frame_history.h"
#include "engine/training/trace.h"

namespace stylet::debrief {

/// One thread at a time.
class Footage {
public:
  virtual ~Footage() = default;
  virtual const FrameHistory& frames() const = 0;
  /// The frame of a time with what the procedure showed then. @return false: nothing was kept
  virtual bool frame_at(double time_s, state::FrameState& frame) = 0;
  virtual const training::Trace& trace() const = 0;
  /// Of the session, s.
  virtual double duration_s() const = 0;
};

}  // namespace stylet::debrief
