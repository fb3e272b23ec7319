#include "engine/app/replay_window.h"

#include "engine/desktop/input_commands.h"
#include "engine/desktop/replay_keys.h"
#include "engine/figures/canvas.h"
#include "engine/render/renderer.h"
#include "engine/scanner/live_scanner.h"
#include "engine/stills/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <thread>

namespace stylet::app {

namespace {

/// Thrown into the replay when nobody looks any more.
struct WindowClosed {};

/// The replay on a thread of its own; stops it and joins on destruction.
class ReplayThread {
public:
  explicit ReplayThread(debrief::SessionReplay& replay)
      : thread_([this, &replay] {
          try {
            replay.run([this](double) {
              if (closed_) throw WindowClosed();
            });
          } catch (const WindowClosed&) {
          } catch (...) {
            failure_ = std::current_exception();
          }
          done_ = true;
        }) {}
  ~ReplayThread() {
    closed_ = true;
    if (thread_.joinable()) thread_.join();
  }
  bool done() const { return done_; }
  /// When done().
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

private:
  std::atomic<bool> closed_{false};
  std::atomic<bool> done_{false};
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace

void show_replay(view::Display& display, gpu::Device& device, const content::Scene& scene,
                 debrief::SessionReplay& replay, debrief::Playback playback, Observer& observer) {
  view::Window window(display, device, {.title = fmt::format("Stylet replay: {}", scene.name)});
  scanner::LiveScanner scanner(device, scene, scanner::ScannerConsole(scene.probe));
  render::Renderer renderer(device, scene, {.width = 800, .height = 720});
  const figures::Font font = figures::Font::load();
  state::FrameState frame = replay.frames().make_frame();
  content::Camera camera = scene.camera;
  const ReplayThread thread(replay);
  auto before = std::chrono::steady_clock::now();
  while (!observer.stop_requested()) {
    if (thread.done()) thread.rethrow();
    const view::Input input = window.poll();
    for (const desktop::Command& command : desktop::commands_of(input)) {
      if (std::holds_alternative<desktop::EndSession>(command)) return;
      if (const auto* look = std::get_if<view::CameraCommand>(&command)) {
        camera = view::after(*look, camera, scene.camera);
      }
    }
    for (const view::Stroke& stroke : input.strokes) {
      if (const auto command = desktop::playback_command_of(stroke)) playback.apply(*command);
    }
    const auto now = std::chrono::steady_clock::now();
    playback.advance(std::chrono::duration<double>(now - before).count(), replay.frames().end_s());
    before = now;
    if (window.minimised() || !replay.frame_at(playback.time_s(), frame)) {
      window.idle();
      continue;
    }
    scanner.draw(frame);
    const gpu::Image& view = renderer.render(frame, camera, {.plane = scanner.in_view()});
    const picture::Pane pane = picture::PaneLayout::of(window.width(), window.height(), true).plot;
    picture::Picture info(std::max(pane.width, 1), std::max(pane.height, 1));
    figures::Canvas canvas(info);
    canvas.text(font, playback.caption(), {16, 28}, 17, {226, 232, 236, 255});
    canvas.text(font,
                fmt::format("{}in tissue {:.0f} mm   force {:.2f} N", stills::distance_in_words(frame),
                            frame.insertion_depth * 1e3F, frame.force.norm()),
                {16, 56}, 15, {150, 160, 168, 255});
    window.present(view, &scanner.screen(), &info);
  }
}

}  // namespace stylet::app
