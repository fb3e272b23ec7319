#include "engine/gpu/pipeline.h"

#include <array>

namespace stylet::gpu {

namespace {

VkDescriptorType descriptor_type(Slot slot) {
  switch (slot) {
    case Slot::storage_buffer:
      return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    case Slot::uniform_buffer:
      return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    case Slot::texel_buffer:
      return VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    case Slot::sampled_image:
      return VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    case Slot::storage_image:
      return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
  }
  throw GpuError("gpu::Slot: unknown value");
}

ShaderModuleHandle shader_module(Device& device, std::span<const std::uint32_t> spirv) {
  VkShaderModuleCreateInfo create{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  create.codeSize = spirv.size_bytes();
  create.pCode = spirv.data();
  VkShaderModule module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device.handle(), &create, nullptr, &module), "vkCreateShaderModule");
  return {device.handle(), module};
}

/// Keeps the arrays alive that a VkPipelineShaderStageCreateInfo points to.
struct Specialization {
  explicit Specialization(const std::vector<std::uint32_t>& values) {
    for (std::uint32_t i = 0; i < values.size(); ++i) entries.push_back({i, i * 4, 4});
    info = {static_cast<std::uint32_t>(entries.size()), entries.data(), values.size() * 4, values.data()};
  }
  std::vector<VkSpecializationMapEntry> entries;
  VkSpecializationInfo info{};
};

VkPipelineColorBlendAttachmentState blend_state(Blend blend) {
  VkPipelineColorBlendAttachmentState state{};
  state.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  const auto factors = [&](VkBlendFactor src, VkBlendFactor dst, VkBlendFactor src_alpha, VkBlendFactor dst_alpha) {
    state.blendEnable = VK_TRUE;
    state.srcColorBlendFactor = src;
    state.dstColorBlendFactor = dst;
    state.srcAlphaBlendFactor = src_alpha;
    state.dstAlphaBlendFactor = dst_alpha;
  };
  switch (blend) {
    case Blend::none:
      break;
    case Blend::alpha:
      factors(VK_BLEND_FACTOR_SRC_ALPHA, VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA, VK_BLEND_FACTOR_ONE,
              VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA);
      break;
    case Blend::premultiplied:
      factors(VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA, VK_BLEND_FACTOR_ONE,
              VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA);
      break;
    case Blend::additive:
      factors(VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE);
      break;
    case Blend::transmittance:
      factors(VK_BLEND_FACTOR_ZERO, VK_BLEND_FACTOR_ONE_MINUS_SRC_COLOR, VK_BLEND_FACTOR_ZERO,
              VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA);
      break;
  }
  return state;
}

}  // namespace

PipelineLayout::PipelineLayout(Device& device, const Interface& interface, VkShaderStageFlags stages)
    : slots_(interface.slots), push_constant_bytes_(interface.push_constant_bytes), stages_(stages) {
  if (push_constant_bytes_ > 128) throw GpuError("gpu::PipelineLayout: more than 128 bytes of push constants");
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (std::uint32_t i = 0; i < slots_.size(); ++i)
    bindings.push_back({i, descriptor_type(slots_[i]), 1, stages, nullptr});
  VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
  set.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR;
  set.bindingCount = static_cast<std::uint32_t>(bindings.size());
  set.pBindings = bindings.data();
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  check(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_layout), "vkCreateDescriptorSetLayout");
  set_layout_ = SetLayoutHandle(device.handle(), set_layout);

  const VkPushConstantRange range{stages, 0, push_constant_bytes_};
  VkPipelineLayoutCreateInfo create{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  create.setLayoutCount = 1;
  create.pSetLayouts = &set_layout;
  create.pushConstantRangeCount = push_constant_bytes_ > 0 ? 1 : 0;
  create.pPushConstantRanges = &range;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(vkCreatePipelineLayout(device.handle(), &create, nullptr, &layout), "vkCreatePipelineLayout");
  layout_ = PipelineLayoutHandle(device.handle(), layout);
}

ComputePipeline::ComputePipeline(Device& device, std::span<const std::uint32_t> spirv, const Interface& interface)
    : layout_(device, interface, VK_SHADER_STAGE_COMPUTE_BIT) {
  const ShaderModuleHandle module = shader_module(device, spirv);
  const Specialization specialization(interface.specialization);
  VkComputePipelineCreateInfo create{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
  create.stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  nullptr,
                  0,
                  VK_SHADER_STAGE_COMPUTE_BIT,
                  module.get(),
                  "main",
                  &specialization.info};
  create.layout = layout_.handle();
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &create, nullptr, &pipeline),
        "vkCreateComputePipelines");
  pipeline_ = PipelineHandle(device.handle(), pipeline);
}

GraphicsPipeline::GraphicsPipeline(Device& device, const GraphicsSettings& settings)
    : layout_(device, settings.interface, VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT) {
  const ShaderModuleHandle vertex = shader_module(device, settings.vertex);
  ShaderModuleHandle fragment;
  if (!settings.fragment.empty()) fragment = shader_module(device, settings.fragment);
  const Specialization specialization(settings.interface.specialization);
  const std::array<VkPipelineShaderStageCreateInfo, 2> stages{{
      {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, nullptr, 0, VK_SHADER_STAGE_VERTEX_BIT, vertex.get(),
       "main", &specialization.info},
      {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, nullptr, 0, VK_SHADER_STAGE_FRAGMENT_BIT, fragment.get(),
       "main", &specialization.info},
  }};
  const VkPipelineVertexInputStateCreateInfo vertex_input{VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
  VkPipelineInputAssemblyStateCreateInfo assembly{VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
  assembly.topology = settings.topology;
  VkPipelineViewportStateCreateInfo viewport{VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
  viewport.viewportCount = 1;
  viewport.scissorCount = 1;
  VkPipelineRasterizationStateCreateInfo raster{VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
  raster.polygonMode = VK_POLYGON_MODE_FILL;
  raster.cullMode = settings.cull;
  raster.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  raster.lineWidth = 1;
  VkPipelineMultisampleStateCreateInfo multisample{VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
  multisample.rasterizationSamples = settings.samples;
  multisample.alphaToCoverageEnable = settings.alpha_to_coverage;
  VkPipelineDepthStencilStateCreateInfo depth{VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
  depth.depthTestEnable = settings.depth_test;
  depth.depthWriteEnable = settings.depth_write;
  depth.depthCompareOp = settings.depth_compare;
  std::vector<VkPipelineColorBlendAttachmentState> attachments;
  for (Blend blend : settings.blend) {
    attachments.push_back(blend_state(blend));
    if (!settings.colour_write) attachments.back().colorWriteMask = 0;
  }
  VkPipelineColorBlendStateCreateInfo blend{VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
  blend.attachmentCount = static_cast<std::uint32_t>(attachments.size());
  blend.pAttachments = attachments.data();
  const std::array<VkDynamicState, 2> dynamic_states{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  VkPipelineDynamicStateCreateInfo dynamic{VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO};
  dynamic.dynamicStateCount = dynamic_states.size();
  dynamic.pDynamicStates = dynamic_states.data();

  VkGraphicsPipelineCreateInfo create{VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
  create.stageCount = settings.fragment.empty() ? 1 : 2;
  create.pStages = stages.data();
  create.pVertexInputState = &vertex_input;
  create.pInputAssemblyState = &assembly;
  create.pViewportState = &viewport;
  create.pRasterizationState = &raster;
  create.pMultisampleState = &multisample;
  create.pDepthStencilState = &depth;
  create.pColorBlendState = &blend;
  create.pDynamicState = &dynamic;
  create.layout = layout_.handle();
  create.renderPass = settings.render_pass;
  create.subpass = settings.subpass;
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &create, nullptr, &pipeline),
        "vkCreateGraphicsPipelines");
  pipeline_ = PipelineHandle(device.handle(), pipeline);
}

}  // namespace stylet::gpu
