#include "engine/gpu/buffer.h"

namespace stylet::gpu {

Buffer::Buffer(Device& device, VkDeviceSize size, VkBufferUsageFlags usage, Memory memory, VkFormat texels)
    : size_(size) {
  if (size == 0) throw GpuError("gpu::Buffer: size is 0; ask for at least one byte");
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = size;
  create.usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  if (texels != VK_FORMAT_UNDEFINED) create.usage |= VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  check(vkCreateBuffer(device.handle(), &create, nullptr, &buffer), "vkCreateBuffer");
  buffer_ = BufferHandle(device.handle(), buffer);

  VkMemoryRequirements requirements;
  vkGetBufferMemoryRequirements(device.handle(), buffer, &requirements);
  // Coherent host-visible memory always exists (Vulkan guarantees it); cached is a wish, for fast reading.
  constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const VkMemoryPropertyFlags required = memory == Memory::device ? VkMemoryPropertyFlags{0} : kHost;
  VkMemoryPropertyFlags preferred = 0;
  if (memory == Memory::device) preferred = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  if (memory == Memory::readback) preferred = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  const bool addressed = (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) != 0;
  memory_ = device.allocate(requirements, required, preferred, addressed);
  check(vkBindBufferMemory(device.handle(), buffer, memory_.get(), 0), "vkBindBufferMemory");

  if (texels != VK_FORMAT_UNDEFINED) {
    VkBufferViewCreateInfo see{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
    see.buffer = buffer;
    see.format = texels;
    see.range = VK_WHOLE_SIZE;
    VkBufferView view = VK_NULL_HANDLE;
    check(vkCreateBufferView(device.handle(), &see, nullptr, &view), "vkCreateBufferView");
    view_ = BufferViewHandle(device.handle(), view);
  }
  if (memory != Memory::device) {
    void* pointer = nullptr;
    check(vkMapMemory(device.handle(), memory_.get(), 0, VK_WHOLE_SIZE, 0, &pointer), "vkMapMemory");
    mapped_ = {static_cast<std::byte*>(pointer), static_cast<std::size_t>(size)};
  }
  if (addressed) {
    VkBufferDeviceAddressInfo ask{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    ask.buffer = buffer;
    address_ = vkGetBufferDeviceAddress(device.handle(), &ask);
  }
}

}  // namespace stylet::gpu
