// The stylus that leads the needle.
#pragma once

#include "engine/content/scene.h"
#include "tools/stylet/default_leader.h"
#include "tools/stylet/session_options.h"

#include <string>

namespace stylet::tools {

/// What --device asks for, or the default, which one line on stdout names where a person leads: a stylus that cannot
/// be opened is said and left to the mouse.
/// @param device  of --device, empty: the user did not say. @param log  as of make_stylus()
/// @throws files::ContentError, haptic::hid::HidError
Stylus make_leader(const std::string& device, Seen seen, const content::Scene& scene, haptic::hid::ReportLog* log);

inline constexpr const char* kLeaderHelp =
    "in a window a HID stylus or space mouse that is plugged in, else mouse; in a headset hand; headless recorded";

}  // namespace stylet::tools
