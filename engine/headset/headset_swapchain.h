// The runtime's images of both eyes, one layer an eye, and the copy of a rendered frame into them.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/headset/headset_runtime.h"

#include <vector>

namespace stylet::headset {

/// Thread: the one that uses the device.
class HeadsetSwapchain {
public:
  /// @throws HeadsetError, also if the runtime offers no 8-bit sRGB format
  HeadsetSwapchain(XrSession session, gpu::Device& device, const EyeSize& size);
  ~HeadsetSwapchain();
  HeadsetSwapchain(const HeadsetSwapchain&) = delete;
  HeadsetSwapchain& operator=(const HeadsetSwapchain&) = delete;

  XrSwapchain handle() const { return swapchain_; }
  const EyeSize& size() const { return size_; }
  /// Copies layers 0 and 1 of an R8G8B8A8_SRGB image into the next image; scaled where the sizes differ. Waits for
  /// the runtime, not for the GPU. @throws HeadsetError, gpu::GpuError
  void show(const gpu::Image& eyes);

private:
  void record(gpu::Commands& commands, const gpu::Image& from, const gpu::Image& to) const;

  gpu::Device& device_;
  EyeSize size_;
  XrSwapchain swapchain_ = XR_NULL_HANDLE;
  std::vector<gpu::Image> images_;
  std::vector<gpu::Commands> commands_;  ///< one an image
};

}  // namespace stylet::headset
