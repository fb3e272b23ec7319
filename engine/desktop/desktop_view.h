// A running session on a desktop: pictures, panels, and what mouse and keyboard do to it. Draws into images; whose
// window they are shown in is not its concern.
//
//   view::Input input = window.poll();
//   overlay.begin(...);
//   if (!desktop.handle(overlay.wants_pointer() ? view::without_pointer(input) : input)) return;
//   desktop.draw(window.width(), window.height(), dt);
//   window.present(desktop.scene(), {desktop.scanner_screen(), desktop.scanner_place()}, overlay);
#pragma once

#include "engine/content/scene.h"
#include "engine/desktop/command.h"
#include "engine/desktop/panels.h"
#include "engine/gpu/device.h"
#include "engine/panels/breath_watch.h"
#include "engine/panels/session_watch.h"
#include "engine/render/renderer.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/held_breath.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/picture_watch.h"
#include "engine/sound/speaker.h"
#include "engine/training/training_session.h"
#include "engine/view/input.h"
#include "haptic/mouse_device.h"

#include <cstdint>
#include <future>
#include <optional>
#include <string>
#include <variant>

namespace stylet::desktop {

/// How the user has set things up: outlives a device that is lost.
struct Arrangement {
  scanner::ScannerConsole scanner{content::Probe{}};
  std::optional<content::Camera> camera{};  ///< none: the scene's
  std::optional<content::Camera> home{};    ///< where it is put back to; none: where it sees the needle at the start
  Panels panels{};
};

/// What a user wants when the session is over: one of its buttons, or to do it again.
using EndWish = std::variant<EndButton, CourseButton>;

struct DesktopSettings {
  bool stereo = false;                    ///< both eyes side by side
  haptic::MouseDevice* mouse = nullptr;   ///< led by mouse and keyboard, where they are the stylus
  session::HeldProbe* probe = nullptr;    ///< moved by keys and the middle button
  session::HeldBreath* breath = nullptr;  ///< held when a key or a button asks for it; null: as the scene has it
  std::string breath_button{};            ///< of the stylus that asks too: "button 3"; empty: none
  Arrangement arrangement{};              ///< at the start
  const content::Texts* texts = nullptr;  ///< of another language; null: English
  std::string device{};                   ///< what leads the needle, for the panels
  training::TrainingSession* course = nullptr;  ///< driven by keys and buttons
  scanner::ImageWatcher* images = nullptr;      ///< gets those of the scanner
  session::PictureWatch* pictures = nullptr;    ///< told of every picture shown
  sound::Speaker* speaker = nullptr;            ///< made mute by a key; null: there is no sound
  scanner::SavedImages* saved = nullptr;        ///< gets the images that the trainee saves
};

/// How many pixels of a frame are drawn: fewer where there would not be ten frames a second, all where there are
/// twice as many. Pure.
class RenderScale {
public:
  /// @param frame_s  the last frame took to draw. @return the share of width and height to draw the next with
  double after(double frame_s);
  double now() const { return scale_; }

private:
  double scale_ = 1;
  double seconds_ = 0;  // since it was looked at last
  int frames_ = 0;      // in them
  int quick_looks_ = 0;
};

/// Thread: the one that uses the device.
class DesktopView {
public:
  /// Keeps references to all of them.
  DesktopView(gpu::Device& device, const content::Scene& scene, session::LiveSession& session,
              const DesktopSettings& settings);

  /// @return false: the session is over, or the user wants to end it or to try again
  bool handle(const view::Input& input);
  /// The session is over: what it came to is shown from now on, beside where it ended.
  void end(panels::Ending ending);
  /// Where something of it changes while it is shown. @return null: the session is not over
  panels::Ending* ending() { return ending_ ? &*ending_ : nullptr; }
  /// In place of handle() when the session is over: looking round goes on.
  /// @param next  title of the scenario that comes next; empty: there is none
  /// @return what the user wants now
  std::optional<EndWish> handle_at_end(const view::Input& input, const std::string& next);
  /// Draws the session as it is now for a frame of that size, and its panels into the overlay that has begun.
  /// @param dt_s  since the frame before
  void draw(int width, int height, double dt_s);

  /// The picture last drawn has been handed to the window system. @param clock_s  by any steady clock
  void shown(double clock_s);

  const gpu::Image& scene() const { return renderer_->image(); }
  /// Surfaces are drawn in as few triangles as they will be from now on: where a processor draws, another thread
  /// thins them in the first seconds.
  bool thinned();
  /// Of the scene, so far: what shows the same as before is not drawn again.
  std::uint64_t scenes_drawn() const { return renderer_ ? renderer_->frames_drawn() : 0; }
  const gpu::Image& scanner_screen() const { return scanner_.screen(); }
  /// Time the GPU spent on the passes of the last frame, "view ..." and, where it made an image, "ultrasound ...";
  /// waits for it.
  std::vector<gpu::Timestamps::Span> pass_times() const;
  /// Where it lies in the frame that was drawn.
  const picture::Pane& scanner_place() const { return scanner_place_; }
  const scanner::LiveScanner& scanner() const { return scanner_; }
  const Panels& panels() const { return panels_; }
  Arrangement arrangement() const {
    return {.scanner = scanner_.console(), .camera = camera_, .home = home_, .panels = panels_};
  }

private:
  /// Hands the scanner what the pointer does on its image. @return the rest
  view::Input point_at_image(view::Input input);
  /// What is neither of the course nor the end of the session.
  void apply(const Command& command);
  /// A knob, with a word on what can be done with an image that was frozen just now.
  void turn(const scanner::Command& command);
  std::vector<Choice> end_choices();
  void frame_needle(int width, int height);
  void fit_renderer(int width, int height, double dt_s);

  gpu::Device& device_;
  const content::Scene& scene_;
  session::LiveSession& session_;
  DesktopSettings settings_;
  scanner::LiveScanner scanner_;
  panels::SessionWatch watch_;
  Panels panels_;
  RenderScale scale_;
  std::optional<render::Renderer> renderer_;
  std::future<render::Geometry> thinned_;      ///< not taken by the renderer yet
  std::optional<panels::Ending> ending_;       ///< the session is over
  std::vector<EndWish> end_wishes_;            ///< that can be had, as their buttons are shown
  std::string next_;                           ///< scenario
  std::optional<EndWish> asked_at_end_;        ///< on the panels
  std::vector<training::Action> actions_;      ///< asked for on the panels, not told to the course yet
  std::optional<panels::BreathWatch> breath_;  ///< none: as the scene has it
  picture::Pane scanner_place_{};
  picture::Pane image_place_{};  ///< of the scanner's screen within it
  bool pointing_ = false;        ///< the left button was pressed on the image and is held
  double fits_for_s_ = 0;        ///< the size wanted has not been the renderer's for so long
  bool imaged_ = false;          ///< for the last frame
  state::FrameState frame_;
  content::Camera camera_;
  std::optional<content::Camera> home_;
};

}  // namespace stylet::desktop
