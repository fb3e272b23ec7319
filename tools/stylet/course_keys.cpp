#include "tools/stylet/course_keys.h"

#include <algorithm>

namespace stylet::tools {

namespace {

constexpr int kEnter = 257;  // GLFW's codes
constexpr int kBackspace = 259;

}  // namespace

std::vector<training::Action> course_actions(const view::Input& input, const training::FlowState& state) {
  using training::Action;
  const auto can = [&](Action action) { return std::ranges::find(state.possible, action) != state.possible.end(); };
  std::vector<Action> actions;
  for (const int key : input.keys) {
    if (key == kEnter) actions.push_back(can(Action::start) ? Action::start : Action::finish);
    if (key == 'T') {
      actions.push_back(state.heating                 ? Action::ablation_stop
                        : can(Action::ablation_start) ? Action::ablation_start
                                                      : Action::fire);
    }
    if (key == 'K') actions.push_back(state.paused ? Action::resume : Action::pause);
    if (key == kBackspace) actions.push_back(Action::reset);
  }
  return actions;
}

}  // namespace stylet::tools
