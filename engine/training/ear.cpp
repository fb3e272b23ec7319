#include "engine/training/ear.h"

#include "engine/content/tissue_locator.h"
#include "engine/procedures/kinds.h"
#include "engine/session/puncture_event.h"
#include "engine/training/flow.h"

#include <algorithm>
#include <cmath>

namespace stylet::training {
namespace {

using sound::Cue;
using sound::Sound;

constexpr double kFullForce = 3;  // N on the tip; a puncture is as loud as can be

Cue puncture_cue(double time_s, double force) {
  return {.time_s = time_s, .sound = Sound::puncture, .strength = std::clamp(std::abs(force) / kFullForce, 0.0, 1.0)};
}

}  // namespace

bool Ear::warns(const TraceSample& sample) {
  const std::uint32_t before = before_ ? before_->forbidden : 0U;
  const bool entered = (sample.crossed & ~before) != 0;
  const double force = sample.force.norm();
  const bool pushes = force > kHardPush && !pushed_;
  pushed_ = force > (pushed_ ? kEased : kHardPush);
  if (!(entered || pushes) || sample.time_s - warned_s_ < kWarnAgain) return false;
  warned_s_ = sample.time_s;
  return true;
}

void Ear::step(const TraceSample& sample, std::vector<Cue>& cues) {
  const double elapsed_s = before_ ? sample.time_s - before_->time_s : 0;
  const bool on_bone =
      sample.tip_state == physics::TipState::inside && content::is_bone(scene_.tissues[sample.tissue]);
  if (on_bone && !on_bone_ && sample.time_s - knocked_s_ >= kKnockAgain) {
    const double speed = elapsed_s > 0 ? (sample.tip - before_->tip).norm() / elapsed_s : 0;
    cues.push_back({sample.time_s, Sound::bone, std::clamp(speed / kFastTip, 0.0, 1.0)});
    knocked_s_ = sample.time_s;
  }
  on_bone_ = on_bone;
  if (warns(sample)) cues.push_back({sample.time_s, Sound::warning, 1});
  if (elapsed_s > 0) {
    const double flow = (sample.inspiration - before_->inspiration) / elapsed_s;
    cues.push_back({sample.time_s, Sound::breath, std::clamp(flow / kFullFlow, -1.0, 1.0)});
  }
  before_ = sample;
}

Cue cue_of(double time_s, const physics::Puncture& puncture) {
  return puncture_cue(time_s, puncture.force);
}

std::optional<Cue> cue_of(const recording::EventRecord& event) {
  if (event.name == flow_event::kRefused) return Cue{event.time_s, Sound::warning, 1};
  if (const auto puncture = session::puncture_of(event)) return puncture_cue(puncture->time_s, puncture->force_n);
  for (const procedures::Kind* kind : procedures::kinds()) {
    if (const auto cue = kind->cue_of(event)) return cue;
  }
  return std::nullopt;
}

std::vector<Cue> cues_of(const content::Scene& scene, const Trace& trace) {
  std::vector<Cue> cues;
  Ear ear(scene);
  for (const TraceSample& sample : trace.samples) ear.step(sample, cues);
  for (const recording::EventRecord& event : trace.events) {
    if (const auto cue = cue_of(event)) cues.push_back(*cue);
  }
  std::ranges::stable_sort(cues, {}, &Cue::time_s);
  return cues;
}

}  // namespace stylet::training
