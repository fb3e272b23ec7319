// What a frame of a window shows, put together: scene, ultrasound image, plot and panels, each in its place.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/image.h"
#include "engine/gpu/pipeline.h"
#include "engine/picture/panes.h"
#include "engine/picture/picture.h"
#include "engine/view/overlay.h"

#include <optional>
#include <vector>

namespace stylet::view {

/// Parts of a frame; null: it has none.
struct FrameParts {
  const gpu::Image* scene = nullptr;       ///< its layers side by side in their pane
  const gpu::Image* ultrasound = nullptr;  ///< bytes mean sRGB, whatever its format says
  const picture::Picture* plot = nullptr;
  Overlay* overlay = nullptr;  ///< over all of it
  picture::PaneLayout layout{};
};

/// Thread: the one that uses the device.
class Composition {
public:
  explicit Composition(gpu::Device& device) : device_(device), timestamps_(device, 3) {}

  /// Records the frame into `target`, whose contents do not matter. A scene of one layer that is enlarged is drawn
  /// without its edges' steps.
  /// @param target  8 bits, sRGB; can be copied to, and is a colour attachment where there is an overlay
  void record(gpu::Commands& commands, const gpu::Image& target, const FrameParts& frame);
  /// GPU time of the last frame: of "smooth_edges", where its scene was enlarged, and of all else, "compose". Call
  /// when its submission is done. Empty: there was none.
  std::vector<gpu::Timestamps::Span> pass_times() const { return timestamps_.read(); }

private:
  /// The same bytes in another format.
  const gpu::Image& twin(gpu::Commands& commands, const gpu::Image& picture, std::optional<gpu::Image>& twin,
                         VkFormat format);
  const gpu::Image& smoothed(gpu::Commands& commands, const gpu::Image& scene);

  /// FXAA, between two images whose bytes mean sRGB.
  struct Smoothing {
    Smoothing(gpu::Device& device, VkExtent3D size);
    gpu::ComputePipeline pipeline;
    gpu::Sampler sampler;
    gpu::Image from, to;
  };

  gpu::Device& device_;
  gpu::Timestamps timestamps_;
  std::optional<Smoothing> smoothing_;
  std::optional<gpu::Image> bytes_;            ///< of the target, before it has them
  std::optional<gpu::Image> ultrasound_copy_;  ///< in the format whose scaling is meant
  std::optional<gpu::Image> plot_copy_;
};

}  // namespace stylet::view
