#include "engine/training/flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stylet::training {
namespace {

using content::SamplingKind;

/// Distance to the nearest target not treated yet, or to the nearest where all are; infinite without any.
double next_target_distance(const FlowInput& input, const std::vector<bool>& treated) {
  const bool all = std::ranges::find(treated, false) == treated.end();
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < input.target_distances.size(); ++i) {
    if (all || !treated[i]) nearest = std::min(nearest, input.target_distances[i]);
  }
  return nearest;
}

}  // namespace

const char* stage_name(Stage stage) {
  static constexpr std::array kNames{"briefing", "procedure", "sampling", "debrief"};
  return kNames[static_cast<std::size_t>(stage)];
}

const char* action_name(Action action) {
  static constexpr std::array<const char*, kActionCount> kNames{"start", "fire",   "ablation_start", "ablation_stop",
                                                                "pause", "resume", "reset",          "finish"};
  return kNames[static_cast<std::size_t>(action)];
}

Flow::Flow(const content::Exercise& exercise, std::size_t targets, bool automatic)
    : exercise_(exercise), automatic_(automatic), treated_(targets, false) {
  state_.prompt = prompt({});
  state_.possible = {Action::start, Action::pause, Action::reset};
}

std::vector<FlowEvent> Flow::step(const FlowInput& input, std::span<const Action> actions) {
  Events events;
  const double elapsed_s = std::max(0.0, input.time_s - now_s_);
  now_s_ = input.time_s;
  if (state_.heating) state_.heated_s += elapsed_s * exercise_.sampling.ablation.time_factor;
  resting_s_ = input.speed <= kRestSpeed ? resting_s_ + elapsed_s : 0;

  if (automatic_ && state_.stage == Stage::briefing) act(Action::start, input, events);
  for (const Action action : actions) act(action, input, events);
  const bool pulled = input.presses != presses_;
  presses_ = input.presses;
  if (pulled && !state_.paused && state_.stage != Stage::debrief) {
    const bool heats = exercise_.sampling.kind == SamplingKind::ablation;
    act(state_.stage == Stage::briefing ? Action::start
        : !heats                        ? Action::fire
        : state_.heating                ? Action::ablation_stop
                                        : Action::ablation_start,
        input, events);
  }
  go_on(input, events);

  state_.stage_s = input.time_s - stage_began_s_;
  if (input.time_s - refused_s_ > kRefusalShown) state_.refusal.clear();
  state_.possible.clear();
  for (int i = 0; i < kActionCount; ++i) {
    const auto action = static_cast<Action>(i);
    if (reason_against(action, input).empty()) state_.possible.push_back(action);
  }
  state_.prompt = prompt(input);
  state_.hint = hint(input);
  return events;
}

std::string Flow::reason_against(Action action, const FlowInput& input) const {
  const content::Sampling& sampling = exercise_.sampling;
  if (action == Action::reset) return "";
  if (state_.stage == Stage::debrief) return "the session is over; try again with reset";
  if (action == Action::resume) return state_.paused ? "" : "the session is not paused";
  if (action == Action::pause) return state_.paused ? "the session is paused already" : "";
  if (action == Action::start) return state_.stage == Stage::briefing ? "" : "the procedure has begun already";
  if (state_.stage == Stage::briefing) return "read the briefing and start first";
  if (action == Action::finish) return "";
  if (state_.paused) return "the session is paused; resume first";

  if (action == Action::fire) {
    if (sampling.kind != SamplingKind::biopsy) return "this needle takes no cores";
    if (state_.samples >= sampling.samples) return "all cores are taken; finish";
    if (state_.samples > 0 && now_s_ - fired_s_ < kCocking) return "the gun is being cocked";
    return input.in_tissue ? "" : "the tip is not in tissue, a core of air is none; advance the needle";
  }
  if (sampling.kind != SamplingKind::ablation) return "this needle is no electrode";
  if (action == Action::ablation_stop) return state_.heating ? "" : "nothing is being heated";
  if (state_.heating) return "it is heating already";
  if (state_.heated_s >= sampling.ablation.duration_s) return "the time of heating is over; finish";
  if (!input.in_tissue) return "the tip is not in tissue; advance the electrode";
  if (input.depth < sampling.ablation.exposed) {
    return fmt::format(
        "of the {:.0f} mm of bare tip {:.0f} are in tissue, the skin would burn; advance the electrode",
        sampling.ablation.exposed * 1e3, input.depth * 1e3);
  }
  return "";
}

void Flow::act(Action action, const FlowInput& input, Events& events) {
  if (const std::string reason = reason_against(action, input); !reason.empty()) {
    events.push_back({flow_event::kRefused, fmt::format("{}: {}", action_name(action), reason)});
    state_.refusal = reason;
    refused_s_ = input.time_s;
    return;
  }
  state_.refusal.clear();
  switch (action) {
    case Action::start:
      return enter(Stage::procedure, input.time_s, events);
    case Action::fire:
    case Action::ablation_start:
      if (const int target = target_at_tip(input); target >= 0) treated_[static_cast<std::size_t>(target)] = true;
      if (action == Action::fire) {
        fired_s_ = input.time_s;
        events.push_back({flow_event::kBiopsyFired, std::to_string(++state_.samples)});
      } else {
        state_.heating = true;
        events.push_back({flow_event::kAblationStarted, ""});
      }
      if (state_.stage != Stage::sampling) enter(Stage::sampling, input.time_s, events);
      return;
    case Action::ablation_stop:
      return stop_heating(events);
    case Action::pause:
    case Action::resume:
      state_.paused = action == Action::pause;
      events.push_back({state_.paused ? flow_event::kPaused : flow_event::kResumed, ""});
      return;
    case Action::reset:
      reset_ = true;
      events.push_back({flow_event::kReset, ""});
      return;
    case Action::finish:
      state_.paused = false;
      if (state_.heating) stop_heating(events);
      return enter(Stage::debrief, input.time_s, events);
  }
}

void Flow::enter(Stage stage, double time_s, Events& events) {
  state_.stage = stage;
  stage_began_s_ = time_s;
  events.push_back({flow_event::kStage, stage_name(stage)});
}

void Flow::stop_heating(Events& events) {
  state_.heating = false;
  events.push_back({flow_event::kAblationStopped, fmt::format("{:.0f} s", state_.heated_s)});
}

void Flow::go_on(const FlowInput& input, Events& events) {
  const content::Sampling& sampling = exercise_.sampling;
  if (state_.paused) return;
  if (state_.heating && state_.heated_s >= sampling.ablation.duration_s) stop_heating(events);
  if (state_.stage == Stage::sampling && sampling.kind == SamplingKind::biopsy && state_.samples < sampling.samples &&
      now_s_ - fired_s_ >= kCocking) {
    enter(Stage::procedure, input.time_s, events);
  }
  if (!sampling.automatic || state_.stage != Stage::procedure || resting_s_ < kRestTime) return;
  const int target = target_at_tip(input);
  if (target < 0 || treated_[static_cast<std::size_t>(target)]) return;
  const Action action = sampling.kind == SamplingKind::ablation ? Action::ablation_start : Action::fire;
  if (sampling.kind != SamplingKind::none && reason_against(action, input).empty()) act(action, input, events);
}

int Flow::target_at_tip(const FlowInput& input) const {
  for (std::size_t i = 0; i < std::min(input.target_distances.size(), treated_.size()); ++i) {
    if (input.target_distances[i] <= 0) return static_cast<int>(i);
  }
  return -1;
}

std::string Flow::prompt(const FlowInput& input) const {
  const content::Sampling& sampling = exercise_.sampling;
  if (state_.paused) return "Paused. Resume to go on.";
  switch (state_.stage) {
    case Stage::briefing:
      return "Read the briefing; start when you are ready.";
    case Stage::procedure: {
      if (!input.in_tissue) return "Find the target with the probe and advance the needle to it.";
      const bool there = target_at_tip(input) >= 0;
      if (sampling.kind == SamplingKind::none) {
        return there ? "The tip is in the target." : "Advance the needle to the target.";
      }
      const bool heats = sampling.kind == SamplingKind::ablation;
      if (!there) return fmt::format("Advance the {} to the target.", heats ? "electrode" : "needle");
      return heats ? "The electrode is in the target: start the ablation." : "The tip is in the target: fire.";
    }
    case Stage::sampling:
      if (sampling.kind == SamplingKind::biopsy) {
        return state_.samples < sampling.samples
                   ? fmt::format("Core {} of {} is taken.", state_.samples, sampling.samples)
                   : "All cores are taken: withdraw the needle and finish.";
      }
      return state_.heating ? fmt::format("Heating: {:.0f} of {:.0f} s. Hold the electrode still.", state_.heated_s,
                                          sampling.ablation.duration_s)
                            : "The ablation is over: withdraw the electrode and finish.";
    case Stage::debrief:
      return "The session is over.";
  }
  return "";
}

std::string Flow::hint(const FlowInput& input) const {
  const double distance = next_target_distance(input, treated_);
  for (const content::Hint& hint : exercise_.hints) {
    const bool holds = (hint.stage.empty() || hint.stage == stage_name(state_.stage)) &&
                       hint.tip_inside.value_or(input.in_tissue) == input.in_tissue &&
                       hint.probe_lifted.value_or(input.probe_lifted) == input.probe_lifted &&
                       hint.stage_s.holds(state_.stage_s) && hint.depth.holds(input.depth) &&
                       hint.distance.holds(distance) && hint.off_plane.holds(input.off_plane) &&
                       hint.force.holds(input.force) && hint.samples.holds(state_.samples);
    if (holds) return hint.text;
  }
  return "";
}

}  // namespace stylet::training
