#include "engine/desktop/course_keys.h"

#include <algorithm>

namespace stylet::desktop {
namespace {

constexpr int kEnter = 257;  // GLFW's codes
constexpr int kBackspace = 259;

bool can(const training::FlowState& state, training::Action action) {
  return std::ranges::find(state.possible, action) != state.possible.end();
}

}  // namespace

std::vector<CourseChoice> course_choices(const training::FlowState& state) {
  using training::Action;
  const Action next = can(state, Action::start) ? Action::start : Action::finish;
  const Action pause = state.paused ? Action::resume : Action::pause;
  std::vector<CourseChoice> choices;
  const auto offer = [&](const Action& action, const char* key) {
    if (can(state, action)) choices.push_back({action, std::string(action.label), key});
  };
  offer(next, "Enter");
  if (state.trigger) offer(*state.trigger, "T");
  offer(pause, "X");
  offer(Action::reset, "Backspace");
  return choices;
}

std::vector<training::Action> course_actions(const view::Input& input, const training::FlowState& state) {
  using training::Action;
  std::vector<Action> actions;
  for (const int key : input.keys) {
    if (key == kEnter) actions.push_back(can(state, Action::start) ? Action::start : Action::finish);
    if (key == 'T' && state.trigger) actions.push_back(*state.trigger);
    if (key == 'X') actions.push_back(state.paused ? Action::resume : Action::pause);
    if (key == kBackspace) actions.push_back(Action::reset);
  }
  return actions;
}

}  // namespace stylet::desktop
