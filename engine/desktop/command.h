// What can be asked of a session on a desktop: each part of it takes commands of its own.
#pragma once

#include "engine/desktop/course_choices.h"
#include "engine/desktop/panels.h"
#include "engine/scanner/command.h"
#include "engine/session/held_probe.h"
#include "engine/view/orbit.h"
#include "haptic/mouse_device.h"

#include <cstdint>
#include <variant>

namespace stylet::desktop {

struct EndSession {};

/// The patient is to hold the breath, or to breathe on.
struct HoldBreath {};

/// Sound off, or on.
struct ToggleSound {};

/// When the session is over; CourseButton::again does it once more.
enum class EndButton : std::uint8_t {
  next,     ///< scenario
  debrief,  ///< is opened
  film,     ///< is made
  leave,
};

using Command = std::variant<EndSession, HoldBreath, ToggleSound, EndButton, CourseButton, haptic::NeedleMove,
                             session::ProbeCommand, scanner::Command, PanelCommand, view::CameraCommand>;

}  // namespace stylet::desktop
