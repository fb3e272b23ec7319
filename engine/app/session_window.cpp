#include "engine/app/session_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

namespace stylet::app {

namespace {

constexpr double kLongestFrame = 0.5;  // s that panels and sizes count, however long a frame took

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

/// Opens the window before anything is drawn.
gpu::Device& opened(Screen& screen, gpu::Device& device, const content::Scene& scene) {
  screen.open(device, fmt::format("Stylet: {}", scene.name));
  return device;
}

double elapsed_s(std::chrono::steady_clock::time_point& before) {
  const auto now = std::chrono::steady_clock::now();
  return std::min(std::chrono::duration<double>(now - std::exchange(before, now)).count(), kLongestFrame);
}

}  // namespace

bool has_display() {
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

SessionWindow::SessionWindow(Screen& screen, gpu::Device& device, const content::Scene& scene,
                             session::LiveSession& session, const SessionWindowSettings& settings)
    : screen_(screen),
      session_(session),
      settings_(settings),
      desktop_(opened(screen, device, scene), scene, session,
               {.stereo = settings.stereo,
                .mouse = settings.mouse,
                .probe = settings.probe,
                .breath = settings.breath,
                .breath_button = settings.breath_button,
                .arrangement = screen.arrangement,
                .texts = &screen.texts,
                .device = settings.stylus != nullptr ? settings.stylus->name() : "",
                .course = settings.course,
                .images = settings.images,
                .pictures = settings.pictures,
                .speaker = settings.sound != nullptr ? &settings.sound->speaker() : nullptr,
                .saved = settings.saved}),
      before_(std::chrono::steady_clock::now()) {}

SessionWindow::~SessionWindow() {
  screen_.arrangement = desktop_.arrangement();
}

view::Input SessionWindow::begin_frame(double dt_s) {
  view::Overlay& overlay = screen_.overlay();
  const view::Window& window = screen_.window();
  view::Input input = screen_.window().poll();
  overlay.begin(view::overlay_frame(input, window.width(), window.height(), dt_s));
  return overlay.wants_pointer() ? view::without_pointer(std::move(input)) : input;
}

void SessionWindow::show_frame(double dt_s) {
  view::Window& window = screen_.window();
  if (window.minimised()) {
    if (settings_.pictures != nullptr) settings_.pictures->interrupted();
    return window.idle();
  }
  desktop_.draw(window.width(), window.height(), dt_s);
  window.present(desktop_.scene(), {desktop_.scanner_screen(), desktop_.scanner_place()}, screen_.shown_overlay());
  if (desktop_.ending() == nullptr)
    desktop_.shown(std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

bool SessionWindow::run(Observer& observer) {
  StylusWatch watch(*settings_.stylus, observer);
  std::optional<StylusWatch> other_hand;
  if (settings_.probe_device != nullptr) other_hand.emplace(*settings_.probe_device, observer, "probe");
  while (!session_.finished() && !observer.stop_requested()) {
    watch.look();
    if (other_hand) other_hand->look();
    const double passed_s = elapsed_s(before_);
    const double dt_s = session_.lockstep() ? session::kLockstepFrame : passed_s;
    session_.advance(dt_s);
    const view::Input input = begin_frame(dt_s);
    if (!desktop_.handle(input)) return !input.close;
    if (settings_.sound != nullptr && settings_.course != nullptr)
      settings_.sound->follow(session_, *settings_.course);
    show_frame(dt_s);
  }
  return true;
}

std::optional<desktop::EndWish> SessionWindow::frame_at_end(const std::string& next) {
  const double dt_s = elapsed_s(before_);
  const view::Input input = begin_frame(dt_s);
  const auto wish = desktop_.handle_at_end(input, next);
  show_frame(dt_s);
  return wish;
}

}  // namespace stylet::app
