// The application's one window, from the first session to the last: sessions, graphics devices and scenarios come and
// go, it stays as its user has put it.
#pragma once

#include "engine/app/observer.h"
#include "engine/desktop/desktop_view.h"
#include "engine/gpu/device.h"
#include "engine/view/input.h"
#include "engine/view/overlay.h"
#include "engine/view/window.h"

#include <functional>
#include <optional>
#include <string>

namespace stylet::app {

/// Thread: the one that made the Display.
class Screen {
public:
  view::Display& display() { return display_; }

  /// Opens the window with that device, or gives the one that is open another title. @throws gpu::GpuError
  void open(gpu::Device& device, const std::string& title);
  /// Before its device goes: remembers where the window was.
  void close();
  bool is_open() const { return window_.has_value(); }

  /// While it is open.
  view::Window& window() { return *window_; }
  /// With texts as large as the window's size and its display want them, between two frames.
  view::Overlay& overlay();
  /// That of the frame which has begun.
  view::Overlay& shown_overlay() { return *overlay_; }

  /// How its user has set things up.
  desktop::Arrangement arrangement{};
  /// In the language that its user reads.
  content::Texts texts{};

private:
  view::Display display_;
  std::optional<view::WindowPlacement> placement_;
  gpu::Device* device_ = nullptr;
  std::optional<view::Window> window_;
  std::optional<view::Overlay> overlay_;
  int width_ = 0, height_ = 0;  // of the window at the frame before
};

/// Shows panels, and nothing else, until `step` has had enough or the observer asks for the end.
/// @param step  draws them, with what happened and the size of the frame; true: enough
void show_panels(Screen& screen, Observer& observer,
                 const std::function<bool(const view::Input& input, int width, int height)>& step);

}  // namespace stylet::app
