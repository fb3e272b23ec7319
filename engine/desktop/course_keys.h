// The course of a session by keys and buttons.
#pragma once

#include "engine/training/flow.h"
#include "engine/view/window.h"

#include <string>
#include <vector>

namespace stylet::desktop {

/// An action that can be taken now, as a button shows it.
struct CourseChoice {
  training::Action action = training::Action::start;
  std::string label{};
  const char* key = "";  ///< as the keyboard calls it
};
std::vector<CourseChoice> course_choices(const training::FlowState& state);

/// Enter: start, then finish. T (or button 1 of the stylus): fire, or start and stop the heating. X: pause and go on.
/// Backspace: try again.
std::vector<training::Action> course_actions(const view::Input& input, const training::FlowState& state);

}  // namespace stylet::desktop
