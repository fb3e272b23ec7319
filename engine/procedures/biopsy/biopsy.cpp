#include "engine/procedures/biopsy/biopsy.h"

#include "engine/procedures/biopsy/core_replay.h"
#include "engine/procedures/biopsy/core_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace stylet::procedures::biopsy {

namespace {

/// How far the end of a fired stylet lies behind the far side of the target that is nearest to its core, along the
/// needle, m.
double end_beyond_target(const Step& step, const Gun& gun, std::span<const content::Target> targets) {
  const Eigen::Vector3d ahead = step.orientation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d middle = step.tip + gun.notch / 2 * ahead;
  double nearest = std::numeric_limits<double>::infinity();
  double beyond = 0;
  for (std::size_t i = 0; i < std::min(targets.size(), step.targets.size()); ++i) {
    const double distance = (middle - step.targets[i]).norm() - targets[i].radius;
    if (distance >= nearest) continue;
    nearest = distance;
    beyond = (step.tip + gun.throw_length * ahead - step.targets[i]).dot(ahead) - targets[i].radius;
  }
  return beyond;
}

}  // namespace

struct Biopsy::Seen final : Observation {
  std::uint32_t cut = 0;  // cores asked for and cut, so far
  Core core;              // the last of them
  state::CoreTrack track;
};

Biopsy::Biopsy(const content::Scene& scene)
    : scene_(scene), plan_(plan_of(scene.exercise)), target_tissue_(target_tissues(scene)) {
  core_.content.assign(scene.tissues.size(), 0.0);
}

std::unique_ptr<Observation> Biopsy::make_observation() const {
  auto seen = std::make_unique<Seen>();
  seen->core.content.assign(scene_.tissues.size(), 0.0);
  return seen;
}

void Biopsy::observe(const Step& step, Observation* seen) {
  if (const std::uint32_t wanted = wanted_.load(std::memory_order_acquire); wanted != cut_) {
    cut_ = wanted;
    core_.time_s = step.time_s;
    core_.haptic_step = step.haptic_step;
    core_.points = points_ahead(step, plan_.gun, scene_.tissues.size());
    core_.content = core_content(core_.points, scene_.tissues.size());
    core_.target_share = 0;
    for (std::size_t t = 0; t < core_.content.size(); ++t) {
      core_.target_share += target_tissue_[t] ? core_.content[t] : 0;
    }
    core_.end_beyond = end_beyond_target(step, plan_.gun, scene_.targets);
    track_ = core_track(step, plan_.gun, core_.target_share);
  }
  auto& out = static_cast<Seen&>(*seen);
  out.cut = cut_;
  out.core = core_;
  out.track = track_;
}

std::string Biopsy::reason_against(Action, const Situation& now) const {
  if (fired_ >= plan_.samples) {
    return plan_.samples == 1 ? "the core is taken; finish" : fmt::format("all {} cores are taken; finish", fired_);
  }
  if (now.time_s - fired_s_ < kCocking) return "the gun is being cocked";
  if (now.in_tissue) return "";
  return fmt::format("the tip is {}: there is nothing to cut; advance the needle", place_of_free_tip(now));
}

void Biopsy::act(Action, const Situation& now, Events& events) {
  fired_s_ = now.time_s;
  ++fired_;
  wanted_.fetch_add(1, std::memory_order_release);
  events.push_back(event_at(now, kFiredEvent, {{"number", std::int64_t{fired_}}}));
}

bool Biopsy::wants_more(const Situation& now) const {
  return fired_ < plan_.samples && now.time_s - fired_s_ >= kCocking;
}

void Biopsy::catch_up(const Situation& now, Events& events) {
  const auto* seen = static_cast<const Seen*>(now.observation);
  if (seen == nullptr || seen->cut == taken_) return;
  taken_ = seen->cut;
  cores_.push_back(seen->core);
  tracks_.push_back(seen->track);
  tracks_.back().pieces = core_pieces(seen->core.points, target_tissue_);
  events.push_back(to_event(seen->core, scene_));
}

std::string Biopsy::prompt(const PromptInput& input) const {
  const bool one = plan_.samples == 1;
  const std::string finish = with_control("finish", input.controls.finish);
  if (fired_ >= plan_.samples) {
    return one ? fmt::format("The core is taken: withdraw the needle and {}.", finish)
               : fmt::format("All {} cores are taken: withdraw the needle and {}.", fired_, finish);
  }
  if (input.stage == Stage::sampling) {
    return fmt::format("Core {} of {} is taken: the gun is being cocked.", fired_, plan_.samples);
  }
  const std::string core = one ? "the core" : fmt::format("core {} of {}", fired_ + 1, plan_.samples);
  if (input.in_target && plan_.automatic) {
    return input.treated ? "This target has its core: withdraw, and take aim at the next."
                         : fmt::format("The tip is in the target: hold still, and {} is taken by itself.", core);
  }
  if (input.in_target) {
    return fmt::format("The tip is in the target: hold still and {}.",
                       with_control(one ? "fire" : fmt::format("fire for {}", core), input.controls.act));
  }
  return one ? "Advance the needle to the target." : fmt::format("Advance the needle to the target for {}.", core);
}

std::string Biopsy::result_in_words() const {
  std::string text;
  for (std::size_t i = 0; i < cores_.size(); ++i) {
    text +=
        fmt::format("core {} at {:.1f} s: {:.0f} % target\n", i + 1, cores_[i].time_s, 100 * cores_[i].target_share);
  }
  return text;
}

void Biopsy::show(state::FrameState& frame) const {
  frame.cores = tracks_;
}

}  // namespace stylet::procedures::biopsy
