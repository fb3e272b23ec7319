// The window on a desktop: both panes, resized with it, and what mouse and keyboard say. Nothing here runs unless
// asked.
//
//   view::Display display;                                       // throws where there is none: go on headless
//   gpu::Device device({.window_extensions = display.vulkan_extensions()});
//   view::Window window(display, device, {.title = "Stylet"});
//   while (!window.poll().close) window.present(renderer.render(state, camera), &ultrasound);
#pragma once

#include "engine/gpu/commands.h"
#include "engine/picture/panes.h"
#include "engine/view/composition.h"
#include "engine/view/input.h"
#include "engine/view/overlay.h"

#include <Eigen/Core>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct GLFWwindow;

namespace stylet::view {

/// The window system. One at a time, on the main thread. Throws gpu::GpuError "no display ..." where there is none.
class Display {
public:
  Display();
  ~Display();
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;
  /// Of the window library, for `--version`; needs no display.
  static std::string library_version();
  /// For gpu::DeviceSettings::window_extensions.
  std::vector<std::string> vulkan_extensions() const;
};

/// Where a window is, in the units of the window system.
struct WindowPlacement {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  bool maximised = false;
};

struct WindowSettings {
  std::string title = "Stylet";
  std::optional<WindowPlacement> placement{};  ///< where it was before; none: where the window system wants it
  int width = 1280;  ///< pixels at content scale 1; on a display with twice the density twice as many, and not more
                     ///< than fit the screen
  int height = 720;
  int least_width = 0;  ///< that a user can make it; 0: any
  int least_height = 0;
  double frames_per_second = 60;  ///< most; present() sleeps to keep to it. 0: no limit
  bool capture = false;           ///< keep a copy of every frame for last_frame()
};

/// Thread: the one that made the Display.
class Window {
public:
  /// @throws gpu::GpuError if the device cannot draw to this display
  Window(Display& display, gpu::Device& device, const WindowSettings& settings = {});
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Handles pending events; never waits.
  Input poll();
  /// Shows a frame: the layers of `scene` side by side in its pane, and below each other on the right an ultrasound
  /// image and a plot, where given. RGBA of 8 bits; the bytes mean sRGB. While minimised nothing is drawn. Sleeps to
  /// keep to the frame rate.
  void present(const gpu::Image& scene, const gpu::Image* ultrasound = nullptr,
               const picture::Picture* plot = nullptr);
  /// A picture, and where in the window it lies.
  struct Placed {
    const gpu::Image& picture;
    picture::Pane place;
  };
  /// Shows a frame of a session: `scene` fills the window, the ultrasound lies on it, and the panels of `overlay` on
  /// both.
  void present(const gpu::Image& scene, const Placed& ultrasound, Overlay& overlay);
  /// Shows the panels of `overlay` alone, on a dark ground.
  void present(Overlay& overlay);
  /// Before the overlay of the frames so far goes: waits until none of them is drawn any more.
  void forget_overlay();
  /// Of all frames; for the overlay's constructor.
  VkFormat format() const { return format_; }
  /// Pixels that text of one pixel should have: 2 on a display with twice the usual density.
  double content_scale() const;
  /// In place of present() while the window is minimised: keeps to the frame rate, looks whether it is back.
  void idle();
  bool minimised() const { return extent_.width == 0 || extent_.height == 0; }

  void set_title(const std::string& title);
  /// For a window in the place of this one.
  WindowPlacement placement() const;

  int width() const { return static_cast<int>(extent_.width); }
  int height() const { return static_cast<int>(extent_.height); }
  std::uint64_t frames_presented() const { return frames_; }
  /// For tests: asks the window system for another size.
  void resize(int width, int height);
  /// The picture presented last, as the window system got it; empty without WindowSettings::capture.
  picture::Picture last_frame() const;

private:
  struct Surface;
  /// Pixels of the frame.
  Eigen::Vector2d pointer() const;
  void create_swapchain();
  void present(const FrameParts& frame);
  /// Copies the panes into swapchain image `index`.
  void record(gpu::Commands& commands, std::uint32_t index, const FrameParts& frame);
  void pace();

  gpu::Device& device_;
  WindowSettings settings_;
  std::unique_ptr<GLFWwindow, void (*)(GLFWwindow*)> window_;
  std::unique_ptr<Surface> surface_;
  gpu::SwapchainHandle swapchain_;
  VkExtent2D extent_{};
  VkFormat format_ = VK_FORMAT_UNDEFINED;
  std::vector<gpu::Image> images_;
  std::vector<gpu::SemaphoreHandle> drawn_;     ///< one a swapchain image: presentation waits for it
  std::vector<gpu::SemaphoreHandle> acquired_;  ///< one a frame in flight
  std::vector<gpu::Commands> commands_;         ///< one a frame in flight
  Composition composition_{device_};
  std::optional<gpu::Buffer> captured_;
  VkExtent2D captured_size_{};
  std::uint64_t frames_ = 0;
  bool stale_ = false;  ///< the swapchain no longer fits the window
  Input pending_;
  Overlay* overlay_ = nullptr;  ///< of the frames before; keeps framebuffers of the swapchain's images
  double cursor_x_ = 0, cursor_y_ = 0;
  std::chrono::steady_clock::time_point next_frame_{};
};

}  // namespace stylet::view
