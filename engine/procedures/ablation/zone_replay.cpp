#include "engine/procedures/ablation/zone_replay.h"

#include "engine/procedures/ablation/heating.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::procedures::ablation {

ZoneReplay::ZoneReplay(const content::Scene& scene, std::span<const recording::EventRecord> events) : scene_(scene) {
  for (const recording::EventRecord& event : events) {
    if (event.name == kStartedEvent) {
      heatings_.push_back({.begin_s = event.time_s,
                           .end_s = std::numeric_limits<double>::infinity(),
                           .heated_s = std::numeric_limits<double>::infinity(),
                           .haptic_step = event.step});
    } else if (heatings_.empty()) {
      continue;
    } else if (event.name == kStoppedEvent) {
      heatings_.back().end_s = event.time_s;
    } else if (event.name == kAblatedEvent) {
      const double told_s = ablation::heated_s(event).value_or(heatings_.back().heated_s);
      heatings_.back().heated_s = std::min(told_s, most_heated_s());
    }
  }
}

double ZoneReplay::most_heated_s() const {
  constexpr double kLongestFrame = 60;  // s between two looks of a session at its clock
  const Plan& plan = plan_of(scene_.exercise);
  return plan.duration_s + kLongestFrame * plan.time_factor;
}

void ZoneReplay::observe(const Step& step, const Situation& now) {
  if (heatings_.empty()) return;
  const PlacedElectrode placed = placed_electrode(step, scene_);
  for (Heating& heating : heatings_) {
    // Of several steps that consumed that needle, the one that the session looked at.
    if (step.haptic_step != heating.haptic_step || step.time_s > heating.begin_s + kSameTime) continue;
    const std::lock_guard lock(mutex_);
    heating.electrode = placed.electrode;
    heating.body = placed.body;
    heating.target = nearest_target(now);
  }
}

std::optional<ZoneReplay::Heating> ZoneReplay::heating(std::size_t i) const {
  const std::lock_guard lock(mutex_);
  if (i >= heatings_.size() || !heatings_[i].electrode) return std::nullopt;
  return heatings_[i];
}

void ZoneReplay::show_at(double time_s, state::FrameState& frame) {
  frame.zone = zone_at(time_s);
}

std::shared_ptr<const content::HeatedZone> ZoneReplay::zone_at(double time_s) {
  if (time_s < shown_s_) {
    ablation_.reset();
    zone_ = nullptr;
    done_ = 0;
  }
  shown_s_ = time_s;
  const double factor = plan_of(scene_.exercise).time_factor;
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
  zone_ = ablation_->shown(zone_, body_, stopped);
  return zone_;
}

}  // namespace stylet::procedures::ablation
