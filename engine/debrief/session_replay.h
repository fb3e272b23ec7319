// A recording run again with all that a debrief wants to know of it: hashes, force, trace, and what it looked like.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/footage.h"
#include "engine/recording/recording.h"
#include "engine/session/force_recorder.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/replay.h"
#include "engine/session/step_hash.h"
#include "engine/training/replayed_procedure.h"
#include "engine/training/trace.h"

#include <cstdint>

namespace stylet::debrief {

/// Physics runs from the start, since each state follows from the one before; frames() and frame_at() may be looked
/// at from another thread while run() is under way, everything else when it is over.
class SessionReplay final : public Footage {
public:
  /// @param scene      of the recording's scenario and haptic rate
  /// @param recording  both outlive this
  SessionReplay(const content::Scene& scene, const recording::Recording& recording);

  /// Once. @throws files::ContentError  as session::replay()
  void run(const session::RunProgress& progress = {});

  const FrameHistory& frames() const override { return frames_; }
  bool frame_at(double time_s, state::FrameState& frame) override;
  const session::ReplayResult& result() const { return result_; }
  std::uint64_t state_hash() const { return hash_.state(); }
  const figures::ForceTrace& force() const { return force_.trace(); }
  const training::Trace& trace() const override { return trace_; }
  double duration_s() const override { return result_.run.duration_s; }

private:
  const content::Scene& scene_;
  const recording::Recording& recording_;
  session::StepHash hash_;
  session::ForceRecorder force_;
  session::FramePublisher publisher_;
  training::TraceRecorder tracer_;
  training::ReplayedProcedure procedure_;
  training::Trace trace_;
  FrameHistory frames_;
  session::ReplayResult result_;
};

}  // namespace stylet::debrief
