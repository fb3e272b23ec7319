// The course of a session on the keyboard.
#pragma once

#include "engine/training/flow.h"
#include "engine/view/window.h"

#include <vector>

namespace stylet::tools {

/// Enter: start, then finish. T (or button 1 of the stylus): fire, or start and stop the heating. K: pause and go on.
/// Backspace: try again.
std::vector<training::Action> course_actions(const view::Input& input, const training::FlowState& state);

}  // namespace stylet::tools
