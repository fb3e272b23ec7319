#include "engine/desktop/course_choices.h"

#include <algorithm>

namespace stylet::desktop {
namespace {

bool can(const training::FlowState& state, training::Action action) {
  return std::ranges::find(state.possible, action) != state.possible.end();
}

}  // namespace

training::Action action_of(CourseButton button, const training::FlowState& state) {
  using training::Action;
  switch (button) {
    case CourseButton::next:
      return can(state, Action::start) ? Action::start : Action::finish;
    case CourseButton::sample:
      return state.trigger.value_or(Action{"sample"});
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
    if (can(state, action)) choices.push_back({button, action, std::string(action.label)});
  }
  return choices;
}

}  // namespace stylet::desktop
