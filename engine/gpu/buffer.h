// A buffer with its own memory.
#pragma once

#include "engine/gpu/access.h"
#include "engine/gpu/device.h"

#include <cstddef>
#include <span>

namespace stylet::gpu {

enum class Memory {
  device,    ///< fast for the GPU; filled by Commands::upload or a shader
  upload,    ///< host writes through mapped(), the GPU reads
  readback,  ///< the GPU writes, host reads through mapped()
};

class Buffer {
public:
  /// @param size   bytes, > 0
  /// @param usage  VK_BUFFER_USAGE_*; transfer source and destination are always added. With
  ///               VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT, address() is valid.
  /// @param texels  what a texel_buffer slot reads it as; undefined: it is bound to none
  Buffer(Device& device, VkDeviceSize size, VkBufferUsageFlags usage, Memory memory = Memory::device,
         VkFormat texels = VK_FORMAT_UNDEFINED);

  VkBuffer handle() const { return buffer_.get(); }
  VkBufferView view() const { return view_.get(); }
  VkDeviceSize size() const { return size_; }
  VkDeviceAddress address() const { return address_; }
  /// Host view of the whole buffer; empty for Memory::device. Always coherent.
  std::span<std::byte> mapped() const { return mapped_; }
  template <typename T>
  std::span<T> mapped_as() const {
    return {reinterpret_cast<T*>(mapped_.data()), mapped_.size() / sizeof(T)};
  }
  /// Tracks use on the queue, not contents: that is why a const buffer can be bound.
  AccessTracker& tracker() const { return tracker_; }

private:
  BufferHandle buffer_;
  MemoryHandle memory_;
  BufferViewHandle view_;
  VkDeviceSize size_ = 0;
  VkDeviceAddress address_ = 0;
  std::span<std::byte> mapped_;
  mutable AccessTracker tracker_;
};

}  // namespace stylet::gpu
