#include "engine/debrief/live_footage.h"

#include "engine/session/frame_publisher.h"

#include <new>

namespace stylet::debrief {

LiveFootage::LiveFootage(const content::Scene& scene)
    : frames_(session::rest_frame(scene), kMemory), frame_(frames_.make_frame()) {}

void LiveFootage::simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport&,
                                     const physics::TissueState&, const physics::NeedleState&) {
  if (buffer_ == nullptr || buffer_->sample(buffer_->newest_s(), frame_).provenance == state::Provenance::none)
    return;
  try {
    frames_.add(frame_);
  } catch (const std::bad_alloc&) {
    buffer_ = nullptr;  // the session matters more than its pictures: they end here
  }
}

void LiveFootage::complete(const training::Trace& trace, const training::ShownHistory& shown, double duration_s) {
  trace_ = &trace;
  shown_ = &shown;
  duration_s_ = duration_s;
}

bool LiveFootage::frame_at(double time_s, state::FrameState& frame) {
  if (!frames_.sample(time_s, frame)) return false;
  shown_->show_at(frame.time_s, frame);
  return true;
}

}  // namespace stylet::debrief
