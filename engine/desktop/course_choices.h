// The course of a session by four buttons, each of which does what it can do now.
#pragma once

#include "engine/training/flow.h"

#include <cstdint>
#include <string>
#include <vector>

namespace stylet::desktop {

enum class CourseButton : std::uint8_t {
  next,    ///< start, then finish
  sample,  ///< fire, or start and stop the heating
  pause,   ///< and go on
  again,   ///< from the beginning
};

training::Action action_of(CourseButton button, const training::FlowState& state);

/// An action that can be taken now, as a button shows it.
struct CourseChoice {
  CourseButton button = CourseButton::next;
  training::Action action = training::Action::start;
  std::string label{};
};
std::vector<CourseChoice> course_choices(const training::FlowState& state);

}  // namespace stylet::desktop
