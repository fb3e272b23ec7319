#include "engine/procedures/biopsy/core_replay.h"

#include "engine/procedures/biopsy/core.h"
#include "engine/procedures/biopsy/core_sample.h"

#include <cmath>
#include <utility>

namespace stylet::procedures::biopsy {

std::vector<std::uint8_t> points_ahead(const Step& step, const Gun& gun, std::size_t tissues) {
  return core_points(
      step.tissue, tissues, step.tip, step.orientation,
      {.throw_length = gun.throw_length, .dead_length = gun.throw_length - gun.notch, .bore = gun.bore});
}

state::CoreTrack core_track(const Step& step, const Gun& gun, double target_share) {
  const Eigen::Vector3d ahead = step.orientation * Eigen::Vector3d::UnitZ();
  return {.from = step.tip.cast<float>(),
          .to = (step.tip + gun.notch * ahead).cast<float>(),
          .radius = static_cast<float>(gun.bore / 2),
          .target_share = static_cast<float>(target_share),
          .fired_s = step.time_s,
          .throw_length = static_cast<float>(gun.throw_length)};
}

CoreReplay::CoreReplay(const content::Scene& scene, std::span<const recording::EventRecord> events)
    : gun_(plan_of(scene.exercise).gun), target_tissue_(target_tissues(scene)) {
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
    state::CoreTrack track = core_track(step, gun_, core.track.target_share);
    track.pieces = core_pieces(points_ahead(step, gun_, target_tissue_.size()), target_tissue_);
    const std::lock_guard lock(mutex_);
    core.track = std::move(track);
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
