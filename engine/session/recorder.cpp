#include "engine/session/recorder.h"

namespace stylet::session {

void Recorder::haptic_stepped(const HapticStepRecord& record, const physics::NeedleState& needle) {
  RecordingChannel& channel = writer_.haptic();
  channel.add(record);
  haptic_step_ = record.step;
  if (record.step % kHapticStepsPerHash == 0) {
    channel.add(HashRecord{.loop = LoopName::haptic, .step = record.step, .hash = hash_.haptic()});
  }
  if (needle.tip != tip_) {
    channel.add_event(record.time_s, record.step, needle.tip == physics::TipState::inside ? "entered" : "left");
    tip_ = needle.tip;
  }
  if (record.buttons != buttons_) {
    channel.add_event(record.time_s, record.step, "buttons");
    buttons_ = record.buttons;
  }
}

void Recorder::simulation_stepped(const SimulationStepRecord& record, const physics::SimulationReport&,
                                  const physics::TissueState&, const physics::NeedleState&) {
  writer_.simulation().add(record);
  simulation_step_ = record.step;
  if (record.step % kSimulationStepsPerHash == 0) {
    writer_.simulation().add(
        HashRecord{.loop = LoopName::simulation, .step = record.step, .hash = hash_.simulation()});
  }
}

void Recorder::finish() {
  writer_.haptic().add(
      HashRecord{.loop = LoopName::haptic, .final = true, .step = haptic_step_, .hash = hash_.haptic()});
  writer_.simulation().add(
      HashRecord{.loop = LoopName::simulation, .final = true, .step = simulation_step_, .hash = hash_.simulation()});
}

}  // namespace stylet::session
