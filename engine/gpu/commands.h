// Recording work for the queue. Barriers come from what each command says it does with its resources; nobody writes
// one.
//
//   run_now(device, [&](Commands& commands) {
//     commands.upload(labels, std::as_bytes(std::span(voxels)));
//     commands.dispatch(scan, {sample(0, labels, nearest), write(1, echoes)}, {2, 1, 1}, push);
//   });
//   std::vector<float> echo = read_back<float>(device, echoes);
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/image.h"
#include "engine/gpu/pipeline.h"

#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace stylet::gpu {

/// A resource at a binding of set 0, and what the shader does with it.
struct Binding {
  std::uint32_t slot = 0;
  const Buffer* buffer = nullptr;
  const Image* image = nullptr;
  const Sampler* sampler = nullptr;
  bool writes = false;
};
inline Binding read(std::uint32_t slot, const Buffer& buffer) {
  return {slot, &buffer, nullptr, nullptr, false};
}
inline Binding write(std::uint32_t slot, const Buffer& buffer) {
  return {slot, &buffer, nullptr, nullptr, true};
}
inline Binding read(std::uint32_t slot, const Image& storage) {
  return {slot, nullptr, &storage, nullptr, false};
}
inline Binding write(std::uint32_t slot, const Image& storage) {
  return {slot, nullptr, &storage, nullptr, true};
}
inline Binding sample(std::uint32_t slot, const Image& image, const Sampler& sampler) {
  return {slot, nullptr, &image, &sampler, false};
}

/// One command buffer, with the staging memory of its uploads. Reused by begin() after its submission is done.
class Commands {
public:
  explicit Commands(Device& device);

  /// Starts recording anew; waits first until the last submission of these commands is done.
  void begin();
  /// Ends recording and submits; returns the place on the device's timeline for Device::wait.
  std::uint64_t submit(const std::vector<VkSemaphoreSubmitInfo>& waits = {},
                       const std::vector<VkSemaphoreSubmitInfo>& signals = {});
  VkCommandBuffer handle() const { return buffer_; }
  std::uint64_t last_submission() const { return submission_; }

  /// Copies host bytes into a device buffer, at the time the GPU gets here. `bytes` is read at once.
  void upload(const Buffer& to, std::span<const std::byte> bytes, VkDeviceSize offset = 0);
  /// The same with bytes that are not known yet: to be written where this points, whole, before submit().
  std::span<std::byte> upload_later(const Buffer& to, VkDeviceSize size, VkDeviceSize offset = 0);
  /// The whole image, tightly packed, layer by layer. Throws GpuError if the number of bytes is not the image's.
  void upload(const Image& to, std::span<const std::byte> bytes);
  void fill(const Buffer& to, std::uint32_t word);
  void clear(const Image& to, const std::array<float, 4>& colour);
  void copy(const Image& from, const Buffer& to, std::uint32_t layer = 0);

  /// @param push  trivially copyable, as large as the pipeline's push constants
  template <typename Push>
  void dispatch(const ComputePipeline& pipeline, std::initializer_list<Binding> bindings,
                const std::array<std::uint32_t, 3>& groups, const Push& push) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatch_bytes(pipeline, bindings, groups, std::as_bytes(std::span(&push, 1)));
  }
  void dispatch(const ComputePipeline& pipeline, std::initializer_list<Binding> bindings,
                const std::array<std::uint32_t, 3>& groups) {
    dispatch_bytes(pipeline, bindings, groups, {});
  }

  /// Barriers for what draws inside the next render pass will use; must come before it begins.
  void prepare_draw(std::span<const Binding> bindings);
  void prepare_draw(std::initializer_list<Binding> bindings) { prepare_draw(std::span(bindings)); }
  /// Inside a render pass: binds pipeline, resources (prepared before) and push constants for the next draws.
  template <typename Push>
  void bind(const GraphicsPipeline& pipeline, std::initializer_list<Binding> bindings, const Push& push) {
    static_assert(std::is_trivially_copyable_v<Push>);
    bind_bytes(pipeline, std::span(bindings), std::as_bytes(std::span(&push, 1)));
  }
  void bind(const GraphicsPipeline& pipeline, std::initializer_list<Binding> bindings) {
    bind_bytes(pipeline, std::span(bindings), {});
  }

  void transition(const Buffer& buffer, const Access& next);
  void transition(const Image& image, const Access& next, bool discard = false) {
    image.transition(buffer_, next, discard);
  }

private:
  struct Staging {
    Buffer buffer;
    VkDeviceSize used = 0;
  };
  struct Staged {
    VkBuffer buffer;
    VkDeviceSize offset;
    std::span<std::byte> bytes;
  };
  Staged stage(VkDeviceSize size);
  void dispatch_bytes(const ComputePipeline& pipeline, std::span<const Binding> bindings,
                      const std::array<std::uint32_t, 3>& groups, std::span<const std::byte> push);
  void bind_bytes(const GraphicsPipeline& pipeline, std::span<const Binding> bindings,
                  std::span<const std::byte> push);
  void push(VkPipelineBindPoint point, const PipelineLayout& layout, std::span<const Binding> bindings,
            std::span<const std::byte> push);

  Device& device_;
  CommandPoolHandle pool_;
  VkCommandBuffer buffer_ = VK_NULL_HANDLE;
  std::vector<Staging> staging_;
  std::uint64_t submission_ = 0;
};

/// Records with `record`, submits and waits: for loading and for tests.
void run_now(Device& device, const std::function<void(Commands&)>& record);

/// Sets of commands used in turn, so that the host records a frame while the GPU draws the one before.
class FrameRing {
public:
  explicit FrameRing(Device& device, int frames = 2);
  /// The next set, begun: waits until its previous frame is done.
  Commands& next();

private:
  std::vector<Commands> commands_;
  std::size_t index_ = 0;
};

/// Bytes of a layer of an image, tightly packed.
std::vector<std::byte> read_back(Device& device, const Image& image, std::uint32_t layer = 0);
std::vector<std::byte> read_back(Device& device, const Buffer& buffer);
/// The same as values of T, the type of a texel's or an element's component.
template <typename T>
std::vector<T> values_of(const std::vector<std::byte>& bytes) {
  const T* first = reinterpret_cast<const T*>(bytes.data());
  return {first, first + bytes.size() / sizeof(T)};
}
template <typename T>
std::vector<T> read_back(Device& device, const Image& image, std::uint32_t layer = 0) {
  return values_of<T>(read_back(device, image, layer));
}
template <typename T>
std::vector<T> read_back(Device& device, const Buffer& buffer) {
  return values_of<T>(read_back(device, buffer));
}

/// GPU time between marks of one submission.
class Timestamps {
public:
  Timestamps(Device& device, std::uint32_t capacity);
  /// Outside a render pass, once a recording, before the first mark.
  void reset(Commands& commands);
  void mark(Commands& commands, std::string name);
  struct Span {
    std::string name;  ///< of the mark that ends it
    double seconds;
  };
  /// Call after the submission is done.
  std::vector<Span> read() const;

private:
  Device& device_;
  QueryPoolHandle pool_;
  std::uint32_t capacity_;
  std::vector<std::string> names_;
};

}  // namespace stylet::gpu
