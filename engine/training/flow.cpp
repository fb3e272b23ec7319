#include "engine/training/flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace stylet::training {
namespace {

/// Distance to the nearest target not treated yet, or to the nearest where all are; infinite without any.
double next_target_distance(const Situation& now, const std::vector<bool>& treated) {
  const bool all = std::ranges::find(treated, false) == treated.end();
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < now.target_distances.size(); ++i) {
    if (all || !treated[i]) nearest = std::min(nearest, now.target_distances[i]);
  }
  return nearest;
}

constexpr std::array kCourseActions{Action::start, Action::pause, Action::resume, Action::reset, Action::finish};

}  // namespace

const char* stage_name(Stage stage) {
  static constexpr std::array kNames{"briefing", "procedure", "sampling", "debrief"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::string_view stage_of(const recording::EventRecord& event) {
  if (event.name != flow_event::kStage) return {};
  return event.version_1_text().empty() ? event.text("stage") : event.version_1_text();
}

Flow::Flow(const content::Exercise& exercise, std::size_t targets, bool automatic, procedures::Procedure* procedure,
           procedures::Controls controls)
    : exercise_(exercise),
      automatic_(automatic),
      procedure_(procedure),
      controls_(std::move(controls)),
      treated_(targets, false) {
  state_.prompt = prompt({});
  state_.possible = {Action::start, Action::pause, Action::reset};
  if (procedure_ != nullptr) state_.trigger = procedure_->trigger();
}

Events Flow::step(const Situation& now, std::span<const Action> actions) {
  Events events;
  const double elapsed_s = std::max(0.0, now.time_s - now_s_);
  now_s_ = now.time_s;
  if (procedure_ != nullptr) procedure_->pass(elapsed_s);
  resting_s_ = now.speed <= kRestSpeed ? resting_s_ + elapsed_s : 0;

  if (automatic_ && state_.stage == Stage::briefing) act(Action::start, now, events);
  for (const Action& action : actions) act(action, now, events);
  const bool pulled = now.presses != presses_;
  presses_ = now.presses;
  if (pulled && !state_.paused && state_.stage != Stage::debrief) {
    if (state_.stage == Stage::briefing) {
      act(Action::start, now, events);
    } else if (procedure_ != nullptr) {
      act(procedure_->trigger(), now, events);
    }
  }
  go_on(now, events);
  if (state_.stage != Stage::briefing) went_in_ = went_in_ || now.in_patient();

  state_.stage_s = now.time_s - stage_began_s_;
  if (now.time_s - refused_s_ > kRefusalShown) state_.refusal.clear();
  state_.possible.clear();
  const auto offer = [&](const Action& action) {
    if (reason_against(action, now).empty()) state_.possible.push_back(action);
  };
  std::ranges::for_each(kCourseActions, offer);
  if (procedure_ != nullptr) {
    std::ranges::for_each(procedure_->actions(), offer);
    state_.trigger = procedure_->trigger();
  }
  state_.prompt = prompt(now);
  state_.hint = hint(now);
  return events;
}

std::string Flow::reason_against(Action action, const Situation& now) const {
  if (action == Action::reset) return "";
  if (state_.stage == Stage::debrief) return "the session is over; try again with reset";
  if (action == Action::resume) return state_.paused ? "" : "the session is not paused";
  if (action == Action::pause) return state_.paused ? "the session is paused already" : "";
  if (action == Action::start) {
    if (state_.stage != Stage::briefing) return "the procedure has begun already";
    // What is done in the briefing is not measured: nothing may have been done.
    return now.in_patient() && !automatic_ ? "the needle is in the patient already; draw it out, then begin" : "";
  }
  if (state_.stage == Stage::briefing) return "read the briefing and start first";
  if (action == Action::finish) return "";
  if (state_.paused) return "the session is paused; resume first";
  const bool known =
      procedure_ != nullptr && std::ranges::find(procedure_->actions(), action) != procedure_->actions().end();
  return known ? procedure_->reason_against(action, now) : "this exercise has nothing of the kind";
}

void Flow::act(Action action, const Situation& now, Events& events) {
  if (const std::string reason = reason_against(action, now); !reason.empty()) {
    events.push_back(
        procedures::event_at(now, flow_event::kRefused, {{"action", std::string(action.name)}, {"reason", reason}}));
    state_.refusal = reason;
    refused_s_ = now.time_s;
    return;
  }
  state_.refusal.clear();
  if (action == Action::start) {
    enter(Stage::procedure, now, events);
  } else if (action == Action::pause || action == Action::resume) {
    state_.paused = action == Action::pause;
    events.push_back(procedures::event_at(now, state_.paused ? flow_event::kPaused : flow_event::kResumed));
  } else if (action == Action::reset) {
    reset_ = true;
    events.push_back(procedures::event_at(now, flow_event::kReset));
  } else if (action == Action::finish) {
    state_.paused = false;
    if (procedure_ != nullptr) procedure_->finish(now, events);
    enter(Stage::debrief, now, events);
  } else if (procedure_->only_stops(action)) {
    procedure_->act(action, now, events);
  } else {
    if (const int target = target_at_tip(now); target >= 0) treated_[target] = true;
    procedure_->act(action, now, events);
    if (state_.stage != Stage::sampling) enter(Stage::sampling, now, events);
  }
}

void Flow::enter(Stage stage, const Situation& now, Events& events) {
  state_.stage = stage;
  stage_began_s_ = now.time_s;
  events.push_back(procedures::event_at(now, flow_event::kStage, {{"stage", std::string(stage_name(stage))}}));
}

void Flow::go_on(const Situation& now, Events& events) {
  if (state_.paused || procedure_ == nullptr) return;
  procedure_->go_on(now, events);
  if (state_.stage == Stage::sampling && procedure_->wants_more(now)) enter(Stage::procedure, now, events);
  if (!exercise_.plan->automatic || state_.stage != Stage::procedure || resting_s_ < kRestTime) return;
  const int target = target_at_tip(now);
  if (target < 0 || treated_[target]) return;
  const Action action = procedure_->trigger();
  if (reason_against(action, now).empty()) act(action, now, events);
}

int Flow::target_at_tip(const Situation& now) const {
  for (std::size_t i = 0; i < std::min(now.target_distances.size(), treated_.size()); ++i) {
    if (now.target_distances[i] <= 0) return static_cast<int>(i);
  }
  return -1;
}

std::string Flow::prompt(const Situation& now) const {
  if (state_.paused) return "Paused. Resume to go on.";
  const int target = target_at_tip(now);
  const procedures::PromptInput input{.stage = state_.stage,
                                      .in_target = target >= 0,
                                      .treated = target >= 0 && treated_[target],
                                      .controls = controls_};
  switch (state_.stage) {
    case Stage::briefing:
      return controls_.begin.empty() ? "Read the briefing; start when you are ready."
                                     : "Read the briefing; " + controls_.begin + " begins.";
    case Stage::procedure:
      if (!now.in_patient() && !went_in_) return "Find the target with the probe and advance the needle to it.";
      if (!now.in_patient()) return "The needle is out again: take aim, then go in.";
      if (procedure_ != nullptr) return procedure_->prompt(input);
      return input.in_target ? "The tip is in the target." : "Advance the needle to the target.";
    case Stage::sampling:
      return procedure_->prompt(input);
    case Stage::debrief:
      return "The session is over.";
  }
  return "";
}

std::string Flow::hint(const Situation& now) const {
  const double distance = next_target_distance(now, treated_);
  const int samples = procedure_ != nullptr ? procedure_->samples() : 0;
  for (const content::Hint& hint : exercise_.hints) {
    const bool holds = (hint.stage.empty() || hint.stage == stage_name(state_.stage)) &&
                       hint.tip_inside.value_or(now.in_patient()) == now.in_patient() &&
                       hint.probe_lifted.value_or(now.probe_lifted) == now.probe_lifted &&
                       hint.stage_s.holds(state_.stage_s) && hint.depth.holds(now.depth) &&
                       hint.distance.holds(distance) && hint.off_plane.holds(now.off_plane) &&
                       hint.force.holds(now.force) && hint.samples.holds(samples);
    if (holds) return hint.text;
  }
  return "";
}

}  // namespace stylet::training
