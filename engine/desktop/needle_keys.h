// Mouse and keyboard lead the needle, where no stylus does.
#pragma once

#include "engine/view/window.h"
#include "haptic/mouse_device.h"

#include <string>
#include <vector>

namespace stylet::desktop {

/// What the pointer did since the last poll: drags move the needle sideways, with Shift tilt it; the wheel moves it
/// in and out. Window thread.
void lead_by_pointer(haptic::MouseDevice& needle, const view::Input& input);

/// A key pressed, or repeated while it is held. @return whether it means something here. Window thread.
bool lead_by_key(haptic::MouseDevice& needle, const view::Input::Stroke& stroke);

/// The keys and what they do, a line each.
const std::vector<std::string>& needle_help_lines();

}  // namespace stylet::desktop
