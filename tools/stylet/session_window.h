// The window of `stylet train`: 3-D view and ultrasound of the running session, mouse and keyboard.
#pragma once

#include "engine/content/scene.h"
#include "engine/gpu/device.h"
#include "engine/session/live_session.h"
#include "haptic/mouse_device.h"

#include <string>
#include <vector>

namespace stylet::tools {

/// A display to open a window on: DISPLAY or WAYLAND_DISPLAY is set.
bool has_display();

/// Instance extensions the window needs on the Vulkan device; empty without a display.
std::vector<std::string> window_extensions();

struct WindowSettings {
  bool stereo = false;
  haptic::MouseDevice* mouse = nullptr;  ///< fed with drags and wheel when the mouse is the stylus
};

/// Shows the session until it is finished or the window is closed. Main thread.
void show_session(gpu::Device& device, const content::Scene& scene, const session::LiveSession& session,
                  const WindowSettings& settings);

}  // namespace stylet::tools
