// A recorded session in a window, as a film with a player's keys.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "engine/debrief/playback.h"
#include "engine/debrief/session_replay.h"
#include "engine/gpu/device.h"
#include "engine/view/window.h"

namespace stylet::app {

/// Shows what the replay has come to while it runs on a thread of its own, until the window is closed or the
/// observer asks for the end. Main thread. @throws what the replay threw
void show_replay(view::Display& display, gpu::Device& device, const content::Scene& scene,
                 debrief::SessionReplay& replay, debrief::Playback playback, Observer& observer);

}  // namespace stylet::app
