#include "tools/stylet/session_window.h"

#include "tools/stylet/interrupt.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

namespace stylet::tools {

namespace {

constexpr double kLongestFrame = 0.1;  // s that panels and sizes count, however long a frame took

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

bool has_display() {
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

void show_session(view::Display& display, gpu::Device& device, const content::Scene& scene,
                  session::LiveSession& session, const SessionWindowSettings& settings) {
  view::Window window(display, device, {.title = fmt::format("Stylet: {}", scene.name)});
  view::Overlay overlay(device, window.format(), window.content_scale());
  desktop::DesktopView desktop(device, scene, session,
                               {.stereo = settings.stereo,
                                .mouse = settings.mouse,
                                .probe = settings.probe,
                                .arrangement = *settings.arrangement,
                                .device = settings.device,
                                .course = settings.course,
                                .images = settings.images});
  StylusWatch watch(settings.hid);
  auto before = std::chrono::steady_clock::now();
  try {
    while (!session.finished() && !interrupted()) {
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
        window.idle();
        continue;
      }
      desktop.draw(window.width(), window.height(), dt_s);
      window.present(desktop.scene(), &desktop.scanner_screen(), overlay);
    }
  } catch (const gpu::DeviceLost&) {
    *settings.arrangement = desktop.arrangement();
    throw;
  }
}

}  // namespace stylet::tools
