#include "engine/debrief/session_replay.h"

namespace stylet::debrief {

namespace {

/// Keeps each frame that the publisher before it made.
class HistoryRecorder final : public session::StepListener {
public:
  HistoryRecorder(const state::StateBuffer& buffer, FrameHistory& history)
      : buffer_(buffer), history_(history), frame_(buffer.make_frame()) {}

  void simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport&,
                          const physics::TissueState&, const physics::NeedleState&) override {
    if (buffer_.sample(buffer_.newest_s(), frame_).provenance != state::Provenance::none) history_.add(frame_);
  }

private:
  const state::StateBuffer& buffer_;
  FrameHistory& history_;
  state::FrameState frame_;
};

double length_s(const recording::Recording& recording, const content::Scene& scene) {
  return static_cast<double>(recording.haptic.size()) / scene.rates.haptic_hz;
}

}  // namespace

SessionReplay::SessionReplay(const content::Scene& scene, const recording::Recording& recording)
    : scene_(scene),
      recording_(recording),
      force_(scene, length_s(recording, scene)),
      publisher_(scene),
      tracer_(scene, length_s(recording, scene)),
      procedure_(scene, recording.events),
      frames_(session::rest_frame(scene)) {}

void SessionReplay::run(const session::RunProgress& progress) {
  const session::RecordedSettings settings = session::recorded_settings(recording_);
  HistoryRecorder history(publisher_.buffer(), frames_);
  session::CoupledLoops loops(scene_, settings.coupling, settings.start,
                              {&hash_, &force_, &publisher_, &tracer_, &procedure_, &history}, settings.base);
  result_ = session::replay(recording_, loops, hash_, progress);
  trace_ = tracer_.take(recording_.events);
}

bool SessionReplay::frame_at(double time_s, state::FrameState& frame) {
  if (!frames_.sample(time_s, frame)) return false;
  procedure_.show_at(frame.time_s, frame);
  return true;
}

}  // namespace stylet::debrief
