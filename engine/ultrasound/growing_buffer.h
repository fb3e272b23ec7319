// Storage buffers of the passes, and one that grows to what a frame needs.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

namespace stylet::ultrasound {

/// A storage buffer of at least `bytes`; Vulkan knows no empty ones.
/// @param texels  also read at random, texel by texel of this format: a software rasteriser fetches these faster
inline gpu::Buffer storage(gpu::Device& device, std::size_t bytes, VkFormat texels = VK_FORMAT_UNDEFINED) {
  return {device, std::max<VkDeviceSize>(bytes, 16), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::Memory::device, texels};
}

/// A storage buffer that grows to what a frame needs. Growing waits for the device: frames in flight use the old one.
class GrowingBuffer {
public:
  explicit GrowingBuffer(gpu::Device& device, VkFormat texels = VK_FORMAT_UNDEFINED)
      : device_(device), texels_(texels), buffer_(storage(device, 1 << 16, texels)) {}

  template <typename T>
  void upload(gpu::Commands& commands, std::span<const T> items) {
    if (items.size_bytes() > buffer_->size()) {
      device_.wait_idle();
      buffer_.emplace(storage(device_, items.size_bytes() + items.size_bytes() / 2, texels_));
    }
    if (!items.empty()) commands.upload(*buffer_, std::as_bytes(items));
  }
  const gpu::Buffer& buffer() const { return *buffer_; }

private:
  gpu::Device& device_;
  VkFormat texels_;
  std::optional<gpu::Buffer> buffer_;
};

}  // namespace stylet::ultrasound
