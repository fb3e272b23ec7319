// A running session in a window: 3-D view, ultrasound and force curve of the running session, mouse and keyboard.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "engine/desktop/desktop_view.h"
#include "engine/gpu/device.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/picture_watch.h"
#include "engine/training/training_session.h"
#include "engine/view/window.h"
#include "haptic/mouse_device.h"

namespace stylet::app {

/// A display to open a window on: DISPLAY or WAYLAND_DISPLAY is set.
bool has_display();

struct SessionWindowSettings {
  bool stereo = false;
  haptic::MouseDevice* mouse = nullptr;         ///< fed with drags and wheel when the mouse is the stylus
  const haptic::Device* stylus = nullptr;       ///< its coming and going is noted
  session::HeldProbe* probe = nullptr;          ///< moved by keys and the middle button
  desktop::Arrangement* arrangement = nullptr;  ///< at the start and, where the device is lost, then
  training::TrainingSession* course = nullptr;  ///< driven by keys and buttons
  scanner::ImageWatcher* images = nullptr;      ///< gets those of the scanner
  session::PictureWatch* pictures = nullptr;    ///< told of every picture shown
};

/// Shows the session until it is finished, the trainee finishes or resets it, the window is closed or the
/// observer asks for the end. Main thread. @throws gpu::GpuError
void show_in_window(view::Display& display, gpu::Device& device, const content::Scene& scene,
                    session::LiveSession& session, const SessionWindowSettings& settings, Observer& observer);

}  // namespace stylet::app
