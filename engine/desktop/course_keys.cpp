#include "engine/desktop/course_keys.h"

#include <algorithm>
#include <utility>

namespace stylet::desktop {
namespace {

constexpr int kEnter = 257;  // GLFW's codes
constexpr int kBackspace = 259;

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

std::vector<CourseChoice> course_choices(const training::FlowState& state) {
  using training::Action;
  const Action next = can(state, Action::start) ? Action::start : Action::finish;
  const Action pause = state.paused ? Action::resume : Action::pause;
  std::vector<CourseChoice> choices;
  for (const auto& [action, key] : {std::pair{next, "Enter"}, std::pair{sampling_action(state), "T"},
                                    std::pair{pause, "X"}, std::pair{Action::reset, "Backspace"}}) {
    if (can(state, action)) choices.push_back({action, label(action), key});
  }
  return choices;
}

std::vector<training::Action> course_actions(const view::Input& input, const training::FlowState& state) {
  using training::Action;
  std::vector<Action> actions;
  for (const int key : input.keys) {
    if (key == kEnter) actions.push_back(can(state, Action::start) ? Action::start : Action::finish);
    if (key == 'T') {
      actions.push_back(sampling_action(state));
    }
    if (key == 'X') actions.push_back(state.paused ? Action::resume : Action::pause);
    if (key == kBackspace) actions.push_back(Action::reset);
  }
  return actions;
}

}  // namespace stylet::desktop
