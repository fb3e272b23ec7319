#include "engine/session/recorder.h"

#include "engine/session/puncture_event.h"

#include <algorithm>

namespace stylet::session {

void Recorder::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) {
  recording::RecordingChannel& channel = writer_.haptic();
  channel.add(record);
  haptic_step_ = record.step;
  if (record.step % kHapticStepsPerHash == 0) {
    channel.add(
        recording::HashRecord{.loop = recording::LoopName::haptic, .step = record.step, .hash = hash_.haptic()});
  }
  if (needle.puncture_count != punctures_) {
    add_puncture(channel, record.time_s, record.step, scene_, needle.last_puncture);
    punctures_ = needle.puncture_count;
  }
  if (const bool inside = needle.tip == physics::TipState::inside; inside != inside_) {
    channel.add_event(record.time_s, record.step, inside ? "entered" : "left");
    inside_ = inside;
  }
  if (const double bend = needle.damage.bend; bend >= bent_ + kBendStep) {
    channel.add_event(record.time_s, record.step, kBentEvent, {{kBentBy, bend / kBendStep, "deg"}});
    bent_ = bend;
  }
  if (record.buttons != buttons_) {
    channel.add_event(record.time_s, record.step, "buttons", {{"pressed", std::int64_t{record.buttons}}});
    buttons_ = record.buttons;
  }
}

void Recorder::simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport&,
                                  const physics::TissueState&, const physics::NeedleState&) {
  writer_.simulation().add(record);
  simulation_step_ = record.step;
  if (record.step % kSimulationStepsPerHash == 0) {
    writer_.simulation().add(recording::HashRecord{
        .loop = recording::LoopName::simulation, .step = record.step, .hash = hash_.simulation()});
  }
}

void Recorder::force_sent(double time_s, std::uint64_t step, const haptic::GuardedWrench& out) {
  for (int bit = 0; bit < haptic::kOutputFlagCount; ++bit) {
    if (((out.flags >> bit) & 1u) == 0) continue;
    double& last = limited_s_[bit];
    if (time_s - last > kQuiet) {
      writer_.haptic().add_event(time_s, step, kSafetyEvent,
                                 {{kSafetyLimit, std::string_view(haptic::output_flag_name(bit))}});
    }
    last = time_s;
  }
}

void Recorder::finish() {
  writer_.haptic().add(recording::HashRecord{
      .loop = recording::LoopName::haptic, .final = true, .step = haptic_step_, .hash = hash_.haptic()});
  writer_.simulation().add(recording::HashRecord{
      .loop = recording::LoopName::simulation, .final = true, .step = simulation_step_, .hash = hash_.simulation()});
}

double needle_bent_deg(std::span<const recording::EventRecord> events) {
  double most = 0;
  for (const recording::EventRecord& event : events) {
    if (event.name == Recorder::kBentEvent) most = std::max(most, event.number(Recorder::kBentBy).value_or(0));
  }
  return most;
}

}  // namespace stylet::session
