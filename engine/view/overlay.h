// Dear ImGui over a picture: panels, buttons and sliders, drawn into the picture itself.
//
//   view::Overlay overlay(device, VK_FORMAT_B8G8R8A8_SRGB);
//   overlay.begin({.width = 1280, .height = 720, .pointer_x = x, .pointer_y = y});
//   ImGui::Begin("Scanner"); ... ImGui::End();
//   overlay.draw(commands, picture);
#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/image.h"
#include "engine/view/input.h"

#include <map>
#include <memory>

struct ImGuiContext;

namespace stylet::view {

/// What a frame of the overlay starts from.
struct OverlayFrame {
  int width = 0;  ///< of the picture, pixels
  int height = 0;
  double dt_s = 1.0 / 60;  ///< since the frame before
  double pointer_x = -1;   ///< pixels from the upper left corner; negative: there is no pointer
  double pointer_y = -1;
  bool left = false;   ///< button held
  bool right = false;  ///< button held
  double wheel = 0;    ///< notches away from the user
};

/// The frame of a window, from what happened since the last poll.
/// @param dt_s  since the frame before
OverlayFrame overlay_frame(const Input& input, int width, int height, double dt_s = OverlayFrame{}.dt_s);

/// One at a time: Dear ImGui's state is the process's. Thread: the one that uses the device.
class Overlay {
public:
  /// @param format  of all pictures it is drawn into: 8 bits, sRGB
  /// @param scale   of text and spacing: 2 on a display with twice the density
  /// @throws gpu::GpuError
  Overlay(gpu::Device& device, VkFormat format, double scale = 1);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// Begins a frame: until draw() the functions of ImGui make its panels.
  void begin(const OverlayFrame& frame);
  /// Whether pointer and wheel belong to a panel; valid after begin().
  bool wants_pointer() const;
  /// Records the panels over what `target` holds. Ends the frame; a frame that is not drawn ends with the next
  /// begin().
  /// @param target  of the constructor's format, usable as a colour attachment; drawn over in its size
  void draw(gpu::Commands& commands, const gpu::Image& target);
  /// Forgets the pictures drawn into so far, before they are destroyed. The GPU must be done with them.
  void forget_targets() { framebuffers_.clear(); }

  double scale() const { return scale_; }

private:
  struct Context {
    explicit Context(double scale);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    ImGuiContext* context;
  };

  gpu::Device& device_;
  double scale_;
  Context context_;
  gpu::RenderPassHandle render_pass_;
  gpu::DescriptorPoolHandle descriptors_;
  std::map<VkImageView, gpu::FramebufferHandle> framebuffers_;
  bool begun_ = false;
};

}  // namespace stylet::view
