#include "engine/gpu/commands.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace stylet::gpu {

namespace {

constexpr VkDeviceSize kStagingBlock = 4u << 20;  // bytes; a larger upload gets a block of its own

Access compute_access(Slot slot, bool writes) {
  switch (slot) {
    case Slot::sampled_image:
    case Slot::texel_buffer:
      return kComputeSample;
    case Slot::uniform_buffer:
      return kComputeUniform;
    default:
      return writes ? kComputeWrite : kComputeRead;
  }
}

}  // namespace

Commands::Commands(Device& device) : device_(device) {
  VkCommandPoolCreateInfo create{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  create.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  create.queueFamilyIndex = device.queue_family();
  VkCommandPool pool = VK_NULL_HANDLE;
  check(vkCreateCommandPool(device.handle(), &create, nullptr, &pool), "vkCreateCommandPool");
  pool_ = CommandPoolHandle(device.handle(), pool);
  VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  allocate.commandPool = pool;
  allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocate.commandBufferCount = 1;
  check(vkAllocateCommandBuffers(device.handle(), &allocate, &buffer_), "vkAllocateCommandBuffers");
}

void Commands::begin() {
  device_.wait(submission_);
  for (Staging& staging : staging_) staging.used = 0;
  check(vkResetCommandPool(device_.handle(), pool_.get(), 0), "vkResetCommandPool");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(buffer_, &begin), "vkBeginCommandBuffer");
}

std::uint64_t Commands::submit(const std::vector<VkSemaphoreSubmitInfo>& waits,
                               const std::vector<VkSemaphoreSubmitInfo>& signals) {
  check(vkEndCommandBuffer(buffer_), "vkEndCommandBuffer");
  submission_ = device_.submit(buffer_, waits, signals);
  return submission_;
}

Commands::Staged Commands::stage(VkDeviceSize size) {
  constexpr VkDeviceSize kAlign = 16;  // of any texel, so a copy may start here
  const VkDeviceSize needed = (size + kAlign - 1) / kAlign * kAlign;
  auto block = std::find_if(staging_.begin(), staging_.end(),
                            [&](const Staging& s) { return s.used + needed <= s.buffer.size(); });
  if (block == staging_.end()) {
    staging_.push_back({Buffer(device_, std::max(needed, kStagingBlock), 0, Memory::upload)});
    block = std::prev(staging_.end());
  }
  const VkDeviceSize offset = block->used;
  block->used += needed;
  return {block->buffer.handle(), offset, block->buffer.mapped().subspan(offset, size)};
}

void Commands::upload(const Buffer& to, std::span<const std::byte> bytes, VkDeviceSize offset) {
  if (bytes.empty()) return;
  std::ranges::copy(bytes, upload_later(to, bytes.size(), offset).begin());
}

std::span<std::byte> Commands::upload_later(const Buffer& to, VkDeviceSize size, VkDeviceSize offset) {
  if (offset + size > to.size())
    throw GpuError("gpu::Commands::upload: " + std::to_string(size) + " bytes at " + std::to_string(offset) +
                   " do not fit a buffer of " + std::to_string(to.size()));
  const Staged staged = stage(size);
  transition(to, kTransferWrite);
  const VkBufferCopy region{staged.offset, offset, size};
  vkCmdCopyBuffer(buffer_, staged.buffer, to.handle(), 1, &region);
  return staged.bytes;
}

void Commands::upload(const Image& to, std::span<const std::byte> bytes) {
  const VkDeviceSize expected = to.layer_bytes() * to.settings().layers;
  if (bytes.size() != expected)
    throw GpuError("gpu::Commands::upload: " + std::to_string(bytes.size()) + " bytes given, the image has " +
                   std::to_string(expected));
  const Staged staged = stage(bytes.size());
  std::ranges::copy(bytes, staged.bytes.begin());
  transition(to, kTransferWrite, true);
  VkBufferImageCopy region{};
  region.bufferOffset = staged.offset;
  region.imageSubresource = {to.range().aspectMask, 0, 0, to.settings().layers};
  region.imageExtent = to.extent();
  vkCmdCopyBufferToImage(buffer_, staged.buffer, to.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
}

void Commands::fill(const Buffer& to, std::uint32_t word) {
  transition(to, kTransferWrite);
  vkCmdFillBuffer(buffer_, to.handle(), 0, VK_WHOLE_SIZE, word);
}

void Commands::clear(const Image& to, const std::array<float, 4>& colour) {
  transition(to, kTransferWrite, true);
  const VkClearColorValue value{{colour[0], colour[1], colour[2], colour[3]}};
  const VkImageSubresourceRange range = to.range();
  vkCmdClearColorImage(buffer_, to.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &value, 1, &range);
}

void Commands::copy(const Image& from, const Buffer& to, std::uint32_t layer) {
  transition(from, kTransferRead);
  transition(to, kTransferWrite);
  VkBufferImageCopy region{};
  region.imageSubresource = {from.range().aspectMask, 0, layer, 1};
  region.imageExtent = from.extent();
  vkCmdCopyImageToBuffer(buffer_, from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(), 1, &region);
}

void Commands::transition(const Buffer& buffer, const Access& next) {
  const auto needed = buffer.tracker().use({next.stages, next.access, VK_IMAGE_LAYOUT_UNDEFINED});
  if (!needed) return;
  VkBufferMemoryBarrier2 barrier{VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER_2};
  barrier.srcStageMask = needed->src_stages;
  barrier.srcAccessMask = needed->src_access;
  barrier.dstStageMask = needed->dst_stages;
  barrier.dstAccessMask = needed->dst_access;
  barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.buffer = buffer.handle();
  barrier.size = VK_WHOLE_SIZE;
  VkDependencyInfo info{VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
  info.bufferMemoryBarrierCount = 1;
  info.pBufferMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(buffer_, &info);
}

void Commands::push(VkPipelineBindPoint point, const PipelineLayout& layout, std::span<const Binding> bindings,
                    std::span<const std::byte> push) {
  constexpr std::size_t kMaxBindings = 16;
  if (bindings.size() > kMaxBindings || bindings.size() != layout.slots().size() ||
      push.size() != layout.push_constant_bytes())
    throw GpuError("gpu::Commands: " + std::to_string(bindings.size()) + " bindings and " +
                   std::to_string(push.size()) + " bytes of push constants do not match the pipeline's interface");
  std::array<VkDescriptorBufferInfo, kMaxBindings> buffers;
  std::array<VkBufferView, kMaxBindings> views;
  std::array<VkDescriptorImageInfo, kMaxBindings> images;
  std::array<VkWriteDescriptorSet, kMaxBindings> writes;
  for (std::size_t i = 0; i < bindings.size(); ++i) {
    const Binding& binding = bindings[i];
    const Slot slot = layout.slots()[binding.slot];
    VkWriteDescriptorSet& write = writes[i];
    write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstBinding = binding.slot;
    write.descriptorCount = 1;
    if (slot == Slot::texel_buffer) {
      views[i] = binding.buffer->view();
      write.pTexelBufferView = &views[i];
      write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    } else if (binding.buffer != nullptr) {
      buffers[i] = {binding.buffer->handle(), 0, VK_WHOLE_SIZE};
      write.pBufferInfo = &buffers[i];
      write.descriptorType =
          slot == Slot::uniform_buffer ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    } else {
      const bool sampled = slot == Slot::sampled_image;
      images[i] = {sampled ? binding.sampler->handle() : VK_NULL_HANDLE, binding.image->view(),
                   sampled ? VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL : VK_IMAGE_LAYOUT_GENERAL};
      write.pImageInfo = &images[i];
      write.descriptorType = sampled ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    }
  }
  if (!bindings.empty())
    device_.push_descriptors(buffer_, point, layout.handle(), 0, static_cast<std::uint32_t>(bindings.size()),
                             writes.data());
  if (!push.empty())
    vkCmdPushConstants(buffer_, layout.handle(), layout.stages(), 0, static_cast<std::uint32_t>(push.size()),
                       push.data());
}

void Commands::dispatch_bytes(const ComputePipeline& pipeline, std::span<const Binding> bindings,
                              const std::array<std::uint32_t, 3>& groups, std::span<const std::byte> push_bytes) {
  for (const Binding& binding : bindings) {
    const Access access = compute_access(pipeline.layout().slots().at(binding.slot), binding.writes);
    if (binding.buffer != nullptr) transition(*binding.buffer, access);
    if (binding.image != nullptr) transition(*binding.image, access);
  }
  vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
  push(VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), bindings, push_bytes);
  vkCmdDispatch(buffer_, groups[0], groups[1], groups[2]);
}

void Commands::prepare_draw(std::span<const Binding> bindings) {
  for (const Binding& binding : bindings) {
    // A uniform buffer may be read as one or as storage: both are made visible.
    if (binding.buffer != nullptr)
      transition(*binding.buffer, {kDrawStages, kDrawRead.access | kDrawUniform.access, VK_IMAGE_LAYOUT_UNDEFINED});
    if (binding.image != nullptr) transition(*binding.image, binding.sampler != nullptr ? kDrawSample : kDrawRead);
  }
}

void Commands::bind_bytes(const GraphicsPipeline& pipeline, std::span<const Binding> bindings,
                          std::span<const std::byte> push_bytes) {
  vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.handle());
  push(VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.layout(), bindings, push_bytes);
}

void run_now(Device& device, const std::function<void(Commands&)>& record) {
  Commands commands(device);
  commands.begin();
  record(commands);
  device.wait(commands.submit());
}

FrameRing::FrameRing(Device& device, int frames) {
  commands_.reserve(frames);
  for (int i = 0; i < frames; ++i) commands_.emplace_back(device);
}

Commands& FrameRing::next() {
  index_ = (index_ + 1) % commands_.size();
  commands_[index_].begin();
  return commands_[index_];
}

std::vector<std::byte> read_back(Device& device, const Image& image, std::uint32_t layer) {
  const Buffer host(device, image.layer_bytes(), 0, Memory::readback);
  run_now(device, [&](Commands& commands) {
    commands.copy(image, host, layer);
    commands.transition(host, kHostRead);
  });
  return {host.mapped().begin(), host.mapped().end()};
}

std::vector<std::byte> read_back(Device& device, const Buffer& buffer) {
  const Buffer host(device, buffer.size(), 0, Memory::readback);
  run_now(device, [&](Commands& commands) {
    commands.transition(buffer, kTransferRead);
    commands.transition(host, kTransferWrite);
    const VkBufferCopy region{0, 0, buffer.size()};
    vkCmdCopyBuffer(commands.handle(), buffer.handle(), host.handle(), 1, &region);
    commands.transition(host, kHostRead);
  });
  return {host.mapped().begin(), host.mapped().end()};
}

Timestamps::Timestamps(Device& device, std::uint32_t capacity) : device_(device), capacity_(capacity) {
  VkQueryPoolCreateInfo create{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
  create.queryType = VK_QUERY_TYPE_TIMESTAMP;
  create.queryCount = capacity;
  VkQueryPool pool = VK_NULL_HANDLE;
  check(vkCreateQueryPool(device.handle(), &create, nullptr, &pool), "vkCreateQueryPool");
  pool_ = QueryPoolHandle(device.handle(), pool);
}

void Timestamps::reset(Commands& commands) {
  names_.clear();
  vkCmdResetQueryPool(commands.handle(), pool_.get(), 0, capacity_);
}

void Timestamps::mark(Commands& commands, std::string name) {
  if (names_.size() >= capacity_) return;
  vkCmdWriteTimestamp2(commands.handle(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pool_.get(),
                       static_cast<std::uint32_t>(names_.size()));
  names_.push_back(std::move(name));
}

std::vector<Timestamps::Span> Timestamps::read() const {
  if (names_.empty()) return {};
  std::vector<std::uint64_t> ticks(names_.size());
  check(vkGetQueryPoolResults(device_.handle(), pool_.get(), 0, static_cast<std::uint32_t>(ticks.size()),
                              ticks.size() * sizeof(std::uint64_t), ticks.data(), sizeof(std::uint64_t),
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "vkGetQueryPoolResults");
  std::vector<Span> spans;
  const double seconds_per_tick = 1e-9 * static_cast<double>(device_.limits().timestampPeriod);
  for (std::size_t i = 1; i < ticks.size(); ++i)
    spans.push_back({names_[i], static_cast<double>(ticks[i] - ticks[i - 1]) * seconds_per_tick});
  return spans;
}

}  // namespace stylet::gpu
