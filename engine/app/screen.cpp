#include "engine/app/screen.h"

#include "engine/desktop/layout.h"

#include <cmath>
#include <utility>

namespace stylet::app {

void Screen::open(gpu::Device& device, const std::string& title) {
  if (window_ && device_ == &device) return window_->set_title(title);
  close();
  device_ = &device;
  window_.emplace(display_, device,
                  view::WindowSettings{.title = title,
                                       .placement = placement_,
                                       .least_width = desktop::kLeastWidth,
                                       .least_height = desktop::kLeastHeight});
}

void Screen::close() {
  if (window_) placement_ = window_->placement();
  overlay_.reset();
  window_.reset();
  device_ = nullptr;
}

view::Overlay& Screen::overlay() {
  const double wanted = desktop::text_scale(window_->width(), window_->height(), window_->content_scale());
  const bool fits = overlay_ && (window_->minimised() || std::abs(overlay_->scale() / wanted - 1) < 0.02);
  // While the window is being resized the letters stay.
  const int width = std::exchange(width_, window_->width()), height = std::exchange(height_, window_->height());
  const bool resizing = width != width_ || height != height_;
  if (overlay_ && (fits || resizing)) return *overlay_;
  window_->forget_overlay();
  overlay_.reset();  // one at a time
  return overlay_.emplace(*device_, window_->format(), wanted);
}

void show_panels(Screen& screen, Observer& observer,
                 const std::function<bool(const view::Input& input, int width, int height)>& step) {
  for (bool enough = false; !enough && !observer.stop_requested();) {
    view::Overlay& overlay = screen.overlay();
    const view::Input input = screen.window().poll();
    const int width = screen.window().width(), height = screen.window().height();
    overlay.begin(view::overlay_frame(input, width, height));
    enough = step(input, width, height);
    if (screen.window().minimised()) {
      screen.window().idle();
    } else {
      screen.window().present(overlay);
    }
  }
}

}  // namespace stylet::app
