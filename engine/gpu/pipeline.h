// Compute and graphics pipelines from embedded SPIR-V. One descriptor set, pushed at each use.
#pragma once

#include "engine/gpu/device.h"

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::gpu {

/// What is at a binding of set 0.
enum class Slot { storage_buffer, uniform_buffer, texel_buffer, sampled_image, storage_image };

/// Everything a pipeline's shaders are given. Binding i of set 0 is slots[i].
struct Interface {
  std::vector<Slot> slots;
  std::uint32_t push_constant_bytes = 0;        ///< at most 128
  std::vector<std::uint32_t> specialization{};  ///< constant_id = i, 4 bytes each; std::bit_cast floats
};

class PipelineLayout {
public:
  PipelineLayout(Device& device, const Interface& interface, VkShaderStageFlags stages);
  VkPipelineLayout handle() const { return layout_.get(); }
  const std::vector<Slot>& slots() const { return slots_; }
  std::uint32_t push_constant_bytes() const { return push_constant_bytes_; }
  VkShaderStageFlags stages() const { return stages_; }

private:
  std::vector<Slot> slots_;
  std::uint32_t push_constant_bytes_;
  VkShaderStageFlags stages_;
  SetLayoutHandle set_layout_;
  PipelineLayoutHandle layout_;
};

class ComputePipeline {
public:
  /// @param spirv  the array in a header made by add_spirv, e.g. scan_comp from "shaders/scan.comp.h"
  ComputePipeline(Device& device, std::span<const std::uint32_t> spirv, const Interface& interface);
  VkPipeline handle() const { return pipeline_.get(); }
  const PipelineLayout& layout() const { return layout_; }

private:
  PipelineLayout layout_;
  PipelineHandle pipeline_;
};

enum class Blend { none, alpha, premultiplied, additive, transmittance };

struct GraphicsSettings {
  std::span<const std::uint32_t> vertex;
  std::span<const std::uint32_t> fragment;  ///< empty: depth only
  Interface interface {};
  VkRenderPass render_pass = VK_NULL_HANDLE;
  std::uint32_t subpass = 0;
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_1_BIT;
  VkPrimitiveTopology topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  VkCullModeFlags cull = VK_CULL_MODE_NONE;
  bool depth_test = false;
  bool depth_write = false;
  VkCompareOp depth_compare = VK_COMPARE_OP_GREATER;
  bool colour_write = true;
  bool alpha_to_coverage = false;         ///< a multisampled edge where the shader fades out
  std::vector<Blend> blend{Blend::none};  ///< one a colour attachment; none at all: depth only
};

/// Vertices are pulled from storage buffers: there is no vertex input. Viewport and scissor are dynamic; front faces
/// are counter-clockwise in the world (clip space has +y up by a negative viewport height); nearer is greater depth
/// (reversed Z: depth is cleared to 0, compared with >).
class GraphicsPipeline {
public:
  GraphicsPipeline(Device& device, const GraphicsSettings& settings);
  VkPipeline handle() const { return pipeline_.get(); }
  const PipelineLayout& layout() const { return layout_; }

private:
  PipelineLayout layout_;
  PipelineHandle pipeline_;
};

}  // namespace stylet::gpu
