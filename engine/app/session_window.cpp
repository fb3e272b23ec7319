#include "engine/app/session_window.h"

#include "engine/app/stylus_watch.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

namespace stylet::app {

namespace {

constexpr double kLongestFrame = 0.5;  // s that panels and sizes count, however long a frame took

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

bool has_display() {
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

void show_in_window(view::Display& display, gpu::Device& device, const content::Scene& scene,
                    session::LiveSession& session, const SessionWindowSettings& settings, Observer& observer) {
  view::Window window(display, device, {.title = fmt::format("Stylet: {}", scene.name)});
  view::Overlay overlay(device, window.format(), window.content_scale());
  desktop::DesktopView desktop(device, scene, session,
                               {.stereo = settings.stereo,
                                .mouse = settings.mouse,
                                .probe = settings.probe,
                                .arrangement = *settings.arrangement,
                                .device = settings.stylus->name(),
                                .course = settings.course,
                                .images = settings.images,
                                .pictures = settings.pictures});
  StylusWatch watch(*settings.stylus, observer);
  auto before = std::chrono::steady_clock::now();
  try {
    while (!session.finished() && !observer.stop_requested()) {
      watch.look();
      const auto now = std::chrono::steady_clock::now();
      const double dt_s = session.lockstep()
                              ? session::kLockstepFrame
                              : std::min(std::chrono::duration<double>(now - before).count(), kLongestFrame);
      before = now;
      session.advance(dt_s);
      const view::Input input = window.poll();
      overlay.begin({.width = window.width(),
                     .height = window.height(),
                     .dt_s = dt_s,
                     .pointer_x = input.pointer_x,
                     .pointer_y = input.pointer_y,
                     .left = input.left,
                     .right = input.right,
                     .wheel = input.wheel});
      if (!desktop.handle(overlay.wants_pointer() ? view::without_pointer(input) : input)) return;
      if (window.minimised()) {
        if (settings.pictures != nullptr) settings.pictures->interrupted();
        window.idle();
        continue;
      }
      desktop.draw(window.width(), window.height(), dt_s);
      window.present(desktop.scene(), &desktop.scanner_screen(), overlay);
      desktop.shown(std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count());
    }
  } catch (const gpu::DeviceLost&) {
    *settings.arrangement = desktop.arrangement();
    throw;
  }
}

}  // namespace stylet::app
