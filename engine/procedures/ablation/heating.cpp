#include "engine/procedures/ablation/heating.h"

#include <fmt/format.h>

#include <array>

namespace stylet::procedures::ablation {

struct Heating::Seen final : Observation {
  PlacedElectrode placed;
};

PlacedElectrode placed_electrode(const Step& step, const content::Scene& scene) {
  const Eigen::Vector3d axis = step.orientation * Eigen::Vector3d::UnitZ();
  return {.electrode = {.tip = step.at_tip.rest,
                        .base = step.tissue.find(step.tip - plan_of(scene.exercise).exposed * axis).rest,
                        .radius = scene.needle.outer_diameter / 2},
          .body = step.at_tip.body};
}

Heating::Heating(const content::Scene& scene) : scene_(scene), plan_(plan_of(scene.exercise)) {}

std::unique_ptr<Observation> Heating::make_observation() const {
  return std::make_unique<Seen>();
}

void Heating::observe(const Step& step, Observation* seen) {
  static_cast<Seen&>(*seen).placed = placed_electrode(step, scene_);
}

std::span<const Action> Heating::actions() const {
  static constexpr std::array kActions{kStart, kStop};
  return kActions;
}

std::string Heating::reason_against(Action action, const Situation& now) const {
  if (action == kStop) return heating_ ? "" : "nothing is being heated";
  if (heating_) return "it is heating already";
  if (heated_s_ >= plan_.duration_s) return "the time of heating is over; finish";
  if (!now.in_tissue) return fmt::format("the tip is {}; advance the electrode", place_of_free_tip(now));
  if (now.depth < plan_.exposed) {
    return fmt::format(
        "of the {:.0f} mm of bare tip {:.0f} are in tissue, the skin would burn; advance the electrode",
        plan_.exposed * 1e3, now.depth * 1e3);
  }
  return "";
}

void Heating::act(Action action, const Situation& now, Events& events) {
  if (action == kStop) return stop(now, events);
  heating_ = true;
  events.push_back(event_at(now, kStartedEvent));
  if (now.observation == nullptr) return;
  const PlacedElectrode& placed = static_cast<const Seen&>(*now.observation).placed;
  body_ = placed.body;
  if (ablation_) {
    ablation_->place(placed.electrode);
  } else {
    ablation_.emplace(scene_, placed.electrode, nearest_target(now));
  }
}

void Heating::pass(double elapsed_s) {
  if (heating_) heated_s_ += elapsed_s * plan_.time_factor;
}

void Heating::go_on(const Situation& now, Events& events) {
  if (heating_ && heated_s_ >= plan_.duration_s) stop(now, events);
}

void Heating::finish(const Situation& now, Events& events) {
  if (heating_) stop(now, events);
}

void Heating::stop(const Situation& now, Events& events) {
  heating_ = false;
  stopped_s_ = now.time_s;
  events.push_back(event_at(now, kStoppedEvent, {{"heated", heated_s_, "s"}}));
  if (!ablation_) return;
  ablation_->heat_to(heated_s_);
  outcome_ = {.heated_s = ablation_->heated_s(), .volume = ablation_->volume(), .coverage = ablation_->coverage()};
  events.push_back(to_event(*outcome_, now));
  told_ = true;
}

void Heating::catch_up(const Situation& now, Events&) {
  if (!ablation_) return;
  if (heating_) {
    ablation_->heat_to(heated_s_);
  } else {
    ablation_->rest_to((now.time_s - stopped_s_) * plan_.time_factor);
  }
  zone_ = ablation_->shown(zone_, body_, told_);
  told_ = false;
}

std::string Heating::prompt(const PromptInput& input) const {
  if (heating_) {
    return fmt::format("Heating: {:.0f} of {:.0f} s. Hold the electrode still.", heated_s_, plan_.duration_s);
  }
  if (input.stage == Stage::sampling) {
    return fmt::format("The ablation is over: withdraw the electrode and {}.",
                       with_control("finish", input.controls.finish));
  }
  if (!input.in_target) return "Advance the electrode to the target.";
  return fmt::format("The bare tip is in the target: when its middle is, {}.",
                     with_control("start the ablation", input.controls.act));
}

std::string Heating::result_in_words() const {
  if (!outcome_) return {};
  return fmt::format(
      "ablation of {:.0f} s: {:.1f} ml; of the target {:.0f} %, with its margin {:.0f} %; least margin {:.1f} mm\n",
      outcome_->heated_s, outcome_->volume * 1e6, 100 * outcome_->coverage.tumour,
      100 * outcome_->coverage.with_margin, 1e3 * outcome_->coverage.least_margin);
}

void Heating::show(state::FrameState& frame) const {
  frame.zone = zone_;
}

}  // namespace stylet::procedures::ablation
