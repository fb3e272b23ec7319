#include "engine/training/zone_replay.h"

#include "engine/training/flow.h"
#include "engine/training/results.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::training {

ZoneReplay::ZoneReplay(const content::Scene& scene, std::span<const recording::EventRecord> events)
    : scene_(scene), heats_(scene.exercise.sampling.kind == content::SamplingKind::ablation), watch_(scene) {
  if (!heats_) return;
  for (const recording::EventRecord& event : events) {
    if (event.name == flow_event::kAblationStarted) {
      heatings_.push_back({.begin_s = event.time_s,
                           .end_s = std::numeric_limits<double>::infinity(),
                           .heated_s = std::numeric_limits<double>::infinity(),
                           .haptic_step = event.step});
    } else if (heatings_.empty()) {
      continue;
    } else if (event.name == flow_event::kAblationStopped) {
      heatings_.back().end_s = event.time_s;
    } else if (event.name == training_event::kAblated) {
      const double told_s = heated_in(event.detail).value_or(heatings_.back().heated_s);
      heatings_.back().heated_s = std::min(told_s, most_heated_s());
    }
  }
}

double ZoneReplay::most_heated_s() const {
  constexpr double kLongestFrame = 60;  // s between two looks of a session at its clock
  const content::AblationPlan& plan = scene_.exercise.sampling.ablation;
  return plan.duration_s + kLongestFrame * plan.time_factor;
}

void ZoneReplay::haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) {
  if (!heatings_.empty()) watch_.haptic_stepped(record, needle);
}

void ZoneReplay::simulation_stepped(const recording::SimulationStepRecord& record,
                                    const physics::SimulationReport& report, const physics::TissueState& tissue,
                                    const physics::NeedleState& needle) {
  if (heatings_.empty()) return;
  watch_.simulation_stepped(record, report, tissue, needle);
  for (Heating& heating : heatings_) {
    // Of several steps that consumed that needle, the one that the session looked at.
    if (record.needle_step != heating.haptic_step || record.time_s > heating.begin_s + kSameTime) continue;
    const Watched& seen = watch_.latest();
    const std::lock_guard lock(mutex_);
    heating.electrode = seen.electrode;
    heating.body = seen.electrode_body;
    heating.target = nearest_target(seen.input);
  }
}

std::optional<ZoneReplay::Heating> ZoneReplay::heating(std::size_t i) const {
  const std::lock_guard lock(mutex_);
  if (i >= heatings_.size() || !heatings_[i].electrode) return std::nullopt;
  return heatings_[i];
}

const content::HeatedZone* ZoneReplay::zone_at(double time_s) {
  if (time_s < shown_s_) {
    ablation_.reset();
    zone_ = {};
    done_ = 0;
  }
  shown_s_ = time_s;
  const double factor = scene_.exercise.sampling.ablation.time_factor;
  double heated_before_s = 0;
  bool stopped = false;
  for (std::size_t i = 0;; ++i) {
    const std::optional<Heating> now = heating(i);
    if (!now || now->begin_s > time_s) break;
    if (i == done_) {
      ablation_ ? ablation_->place(*now->electrode) : (void)ablation_.emplace(scene_, *now->electrode, now->target);
      body_ = now->body;
      ++done_;
    }
    const double heated_s = heated_before_s + (std::min(time_s, now->end_s) - now->begin_s) * factor;
    heated_before_s = heated_s;
    stopped = time_s >= now->end_s;
    if (i + 1 < done_) continue;  // it was followed to its end
    ablation_->heat_to(std::min({heated_s, now->heated_s, most_heated_s()}));
    if (!stopped) continue;
    ablation_->heat_to(std::isfinite(now->heated_s) ? now->heated_s : std::min(heated_s, most_heated_s()));
    const std::optional<Heating> next = heating(i + 1);
    ablation_->rest_to((std::min(time_s, next ? next->begin_s : time_s) - now->end_s) * factor);
  }
  if (!ablation_) return nullptr;
  ablation_->show(zone_, body_, stopped);
  return &zone_;
}

}  // namespace stylet::training
