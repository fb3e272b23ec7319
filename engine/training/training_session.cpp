#include "engine/training/training_session.h"

#include "engine/training/metrics.h"
#include "engine/training/voxel.h"

#include <algorithm>
#include <array>

namespace stylet::training {

static_assert(flow_event::kBiopsyFired == kFireEvent && flow_event::kAblationStarted == kAblationEvent,
              "the metrics look for the flow's events");

TrainingSession::TrainingSession(const content::Scene& scene, const TrainingSettings& settings)
    : scene_(scene),
      watch_(scene),
      flow_(scene.exercise, scene.targets.size(), settings.automatic),
      target_tissue_(scene.tissues.size(), false) {
  for (const content::Target& target : scene.targets) {
    const std::ptrdiff_t voxel = voxel_at(scene.labels, target.centre);
    if (voxel >= 0) target_tissue_[scene.labels.labels[static_cast<std::size_t>(voxel)]] = true;
  }
}

const FlowState& TrainingSession::poll(session::LiveSession& live, std::span<const Action> actions) {
  const Watched& seen = watch_.latest();
  tip_tissue_ = seen.tip_tissue;
  const std::vector<FlowEvent> events = flow_.step(seen.input, actions);
  record(live, seen, events);
  take_core(live, seen);
  if (flow_.state().paused != live.paused()) flow_.state().paused ? live.pause() : live.resume();
  if (ablation_) let_zone_grow(seen.input.time_s, events);
  return flow_.state();
}

void TrainingSession::let_zone_grow(double time_s, std::span<const FlowEvent> events) {
  const bool told = std::ranges::find(events, flow_event::kAblationStopped, &FlowEvent::name) != events.end();
  if (flow_.state().heating) {
    ablation_->heat_to(flow_.state().heated_s);
  } else {
    ablation_->rest_to((time_s - stopped_s_) * scene_.exercise.sampling.ablation.time_factor);
  }
  ablation_->show(zone_, body_, told);
}

void TrainingSession::end(session::LiveSession& live) {
  constexpr std::array kFinish{Action::finish};
  const Stage stage = flow_.state().stage;
  if (stage == Stage::procedure || stage == Stage::sampling) {
    poll(live, kFinish);
  } else {
    poll(live);
  }
}

void TrainingSession::record(session::LiveSession& live, const Watched& seen, std::span<const FlowEvent> events) {
  for (const FlowEvent& event : events) {
    live.add_event(seen.input.time_s, seen.haptic_step, event.name, event.detail);
    if (event.name == flow_event::kBiopsyFired) watch_.cut_core();
    if (event.name == flow_event::kAblationStarted) {
      body_ = seen.electrode_body;
      if (ablation_) {
        ablation_->place(seen.electrode);
      } else {
        ablation_.emplace(scene_, seen.electrode, nearest_target(seen.input));
      }
    }
    if (event.name == flow_event::kAblationStopped) {
      stopped_s_ = seen.input.time_s;
      tell_ablation(live, seen);
    }
  }
}

void TrainingSession::take_core(session::LiveSession& live, const Watched& seen) {
  if (seen.cores == cores_) return;
  cores_ = seen.cores;
  double share = 0;
  for (std::size_t t = 0; t < seen.core.content.size(); ++t) share += target_tissue_[t] ? seen.core.content[t] : 0;
  result_.cores.push_back(seen.core);
  result_.tumour_shares.push_back(share);
  live.add_event(seen.core.time_s, seen.core.haptic_step, training_event::kCore,
                 core_detail(share, seen.core.content, scene_));
}

void TrainingSession::tell_ablation(session::LiveSession& live, const Watched& seen) {
  ablation_->heat_to(flow_.state().heated_s);
  result_.heated = true;
  result_.heated_s = ablation_->heated_s();
  result_.volume = ablation_->volume();
  result_.coverage = ablation_->coverage();
  live.add_event(seen.input.time_s, seen.haptic_step, training_event::kAblated, ablation_detail(result_));
}

}  // namespace stylet::training
