#include "engine/procedures/biopsy/core_replay.h"

#include "engine/procedures/biopsy/core.h"

#include <cmath>

namespace stylet::procedures::biopsy {

state::CoreTrack core_track(const Step& step, const Gun& gun, double target_share) {
  const Eigen::Vector3d ahead = step.orientation * Eigen::Vector3d::UnitZ();
  return {.from = step.tip.cast<float>(),
          .to = (step.tip + gun.notch * ahead).cast<float>(),
          .radius = static_cast<float>(gun.bore / 2),
          .target_share = static_cast<float>(target_share)};
}

CoreReplay::CoreReplay(const content::Scene& scene, std::span<const recording::EventRecord> events)
    : gun_(plan_of(scene.exercise).gun) {
  for (const recording::EventRecord& event : events) {
    if (const auto percent = target_percent(event))
      taken_.push_back({.time_s = event.time_s,
                        .haptic_step = event.step,
                        .track = {.target_share = static_cast<float>(*percent / 100)}});
  }
}

void CoreReplay::observe(const Step& step, const Situation&) {
  constexpr double kSameTime = 1e-6;  // s
  for (Taken& core : taken_) {
    if (step.haptic_step != core.haptic_step || std::abs(step.time_s - core.time_s) > kSameTime) continue;
    const std::lock_guard lock(mutex_);
    core.track = core_track(step, gun_, core.track.target_share);
    core.seen = true;
  }
}

void CoreReplay::show_at(double time_s, state::FrameState& frame) {
  frame.cores.clear();
  const std::lock_guard lock(mutex_);
  for (const Taken& core : taken_) {
    if (core.seen && core.time_s <= time_s) frame.cores.push_back(core.track);
  }
}

}  // namespace stylet::procedures::biopsy
