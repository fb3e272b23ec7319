// A running session in the window: 3-D view, ultrasound and panels, mouse and keyboard; and what the trainee is shown
// when it is over.
#pragma once

#include "engine/app/observer.h"
#include "engine/app/screen.h"
#include "engine/app/session_sound.h"
#include "engine/app/stylus_watch.h"
#include "engine/content/scene.h"
#include "engine/desktop/desktop_view.h"
#include "engine/gpu/device.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/held_breath.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/picture_watch.h"
#include "engine/training/training_session.h"
#include "haptic/mouse_device.h"

#include <chrono>
#include <optional>
#include <string>

namespace stylet::app {

/// A display to open a window on: DISPLAY or WAYLAND_DISPLAY is set.
bool has_display();

struct SessionWindowSettings {
  bool stereo = false;
  haptic::MouseDevice* mouse = nullptr;          ///< fed with drags and wheel when the mouse is the stylus
  const haptic::Device* stylus = nullptr;        ///< its coming and going is noted; null: the session is over
  const haptic::Device* probe_device = nullptr;  ///< the same of one that leads the probe; null: none
  session::HeldProbe* probe = nullptr;           ///< moved by keys and the middle button
  session::HeldBreath* breath = nullptr;  ///< held when a key or a button asks for it; null: as the scene has it
  std::string breath_button{};            ///< of the stylus that asks too: "button 3"; empty: none
  training::TrainingSession* course = nullptr;  ///< driven by keys and buttons
  scanner::ImageWatcher* images = nullptr;      ///< gets those of the scanner
  session::PictureWatch* pictures = nullptr;    ///< told of every picture shown
  SessionSound* sound = nullptr;                ///< follows the session; null: nothing is heard
  scanner::SavedImages* saved = nullptr;        ///< gets the ultrasound images that the trainee saves
};

/// Main thread.
class SessionWindow {
public:
  /// Keeps references to all of them. @throws gpu::GpuError
  SessionWindow(Screen& screen, gpu::Device& device, const content::Scene& scene, session::LiveSession& session,
                const SessionWindowSettings& settings);
  /// The arrangement stays with the screen.
  ~SessionWindow();
  SessionWindow(const SessionWindow&) = delete;
  SessionWindow& operator=(const SessionWindow&) = delete;

  /// Shows the session until it is finished, the trainee finishes or resets it, the window is closed or the observer
  /// asks for the end. @return false: the window was closed
  /// @throws gpu::GpuError
  bool run(Observer& observer);

  /// The session is over.
  void end(panels::Ending ending) { desktop_.end(std::move(ending)); }
  panels::Ending* ending() { return desktop_.ending(); }
  /// A frame of the session that is over. @param next  as desktop::DesktopView::handle_at_end()
  /// @return what the user wants now. @throws gpu::GpuError
  std::optional<desktop::EndWish> frame_at_end(const std::string& next);

private:
  /// What happened since the last frame, for whoever is not a panel; begins the overlay's frame.
  view::Input begin_frame(double dt_s);
  void show_frame(double dt_s);

  Screen& screen_;
  session::LiveSession& session_;
  SessionWindowSettings settings_;
  desktop::DesktopView desktop_;
  std::chrono::steady_clock::time_point before_;
};

}  // namespace stylet::app
