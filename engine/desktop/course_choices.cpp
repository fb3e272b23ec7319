#include "engine/desktop/course_choices.h"

#include <algorithm>

namespace stylet::desktop {
namespace {

bool can(const training::FlowState& state, training::Action action) {
  return std::ranges::find(state.possible, action) != state.possible.end();
}

training::Action sampling_action(const training::FlowState& state) {
  using training::Action;
  if (state.heating) return Action::ablation_stop;
  return can(state, Action::ablation_start) ? Action::ablation_start : Action::fire;
}

const char* label(training::Action action) {
  using training::Action;
  switch (action) {
    case Action::start:
      return "Start";
    case Action::fire:
      return "Fire";
    case Action::ablation_start:
      return "Heat";
    case Action::ablation_stop:
      return "Stop heating";
    case Action::pause:
      return "Pause";
    case Action::resume:
      return "Go on";
    case Action::reset:
      return "Try again";
    case Action::finish:
      return "Finish";
  }
  return "";
}

}  // namespace

training::Action action_of(CourseButton button, const training::FlowState& state) {
  using training::Action;
  switch (button) {
    case CourseButton::next:
      return can(state, Action::start) ? Action::start : Action::finish;
    case CourseButton::sample:
      return sampling_action(state);
    case CourseButton::pause:
      return state.paused ? Action::resume : Action::pause;
    case CourseButton::again:
      break;
  }
  return Action::reset;
}

std::vector<CourseChoice> course_choices(const training::FlowState& state) {
  std::vector<CourseChoice> choices;
  for (const CourseButton button :
       {CourseButton::next, CourseButton::sample, CourseButton::pause, CourseButton::again}) {
    const training::Action action = action_of(button, state);
    if (can(state, action)) choices.push_back({button, action, label(action)});
  }
  return choices;
}

}  // namespace stylet::desktop
