// The keys of a player that shows a recorded session again.
#pragma once

#include "engine/debrief/playback.h"
#include "engine/view/input.h"

#include <optional>

namespace stylet::desktop {

inline constexpr const char* kReplayKeys =
    "space pauses, left and right seek 1 s (with Shift 0.1 s), Home and End go to the ends, + and - change the "
    "speed,\n"
    "right button turns the camera, R puts it back, Q closes";

/// Nothing: the key means nothing to a player.
std::optional<debrief::PlaybackCommand> playback_command_of(const view::Stroke& stroke);

}  // namespace stylet::desktop
