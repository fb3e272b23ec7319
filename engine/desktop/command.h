// What can be asked of a session on a desktop: each part of it takes commands of its own.
#pragma once

#include "engine/desktop/course_choices.h"
#include "engine/desktop/panels.h"
#include "engine/scanner/command.h"
#include "engine/session/held_probe.h"
#include "engine/view/orbit.h"
#include "haptic/mouse_device.h"

#include <variant>

namespace stylet::desktop {

struct EndSession {};

using Command = std::variant<EndSession, CourseButton, haptic::NeedleMove, session::ProbeCommand, scanner::Command,
                             PanelCommand, view::CameraCommand>;

}  // namespace stylet::desktop
