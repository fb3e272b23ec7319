#include "engine/app/screen.h"

#include "engine/desktop/layout.h"

#include <cmath>

namespace stylet::app {

namespace {

constexpr int kSettled = 10;  // frames that a size stays before the texts take it

}  // namespace

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
  resizing_ = fits ? 0 : resizing_ + 1;
  if (overlay_ && resizing_ <= kSettled) return *overlay_;
  resizing_ = 0;
  window_->forget_overlay();
  overlay_.reset();  // one at a time
  return overlay_.emplace(*device_, window_->format(), wanted);
}

}  // namespace stylet::app
