#include "engine/render/render_pass.h"

#include <array>

namespace stylet::render {

namespace {

VkAttachmentDescription2 attachment(const gpu::Image& image, VkAttachmentLoadOp load, VkAttachmentStoreOp store,
                                    VkImageLayout layout) {
  VkAttachmentDescription2 description{VK_STRUCTURE_TYPE_ATTACHMENT_DESCRIPTION_2};
  description.format = image.format();
  description.samples = image.settings().samples;
  description.loadOp = load;
  description.storeOp = store;
  description.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  description.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  description.initialLayout = layout;
  description.finalLayout = layout;
  return description;
}

constexpr auto kDepth = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;

gpu::FramebufferHandle framebuffer_of(gpu::Device& device, VkRenderPass render_pass,
                                      const std::vector<VkImageView>& views, const gpu::Image& target) {
  VkFramebufferCreateInfo create{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
  create.renderPass = render_pass;
  create.attachmentCount = static_cast<std::uint32_t>(views.size());
  create.pAttachments = views.data();
  create.width = target.settings().width;
  create.height = target.settings().height;
  create.layers = 1;  // multiview addresses the layers itself
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  gpu::check(vkCreateFramebuffer(device.handle(), &create, nullptr, &framebuffer), "vkCreateFramebuffer");
  return {device.handle(), framebuffer};
}

}  // namespace

gpu::RenderPassHandle make_depth_pass(gpu::Device& device, const gpu::Image& depth) {
  const VkAttachmentDescription2 description =
      attachment(depth, VK_ATTACHMENT_LOAD_OP_CLEAR, VK_ATTACHMENT_STORE_OP_STORE, kDepth);
  const VkAttachmentReference2 reference{VK_STRUCTURE_TYPE_ATTACHMENT_REFERENCE_2, nullptr, 0, kDepth,
                                         VK_IMAGE_ASPECT_DEPTH_BIT};
  VkSubpassDescription2 subpass{VK_STRUCTURE_TYPE_SUBPASS_DESCRIPTION_2};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.pDepthStencilAttachment = &reference;
  VkRenderPassCreateInfo2 create{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO_2};
  create.attachmentCount = 1;
  create.pAttachments = &description;
  create.subpassCount = 1;
  create.pSubpasses = &subpass;
  VkRenderPass render_pass = VK_NULL_HANDLE;
  gpu::check(vkCreateRenderPass2(device.handle(), &create, nullptr, &render_pass), "vkCreateRenderPass2");
  return {device.handle(), render_pass};
}

gpu::FramebufferHandle make_framebuffer(gpu::Device& device, VkRenderPass render_pass, const gpu::Image& depth) {
  return framebuffer_of(device, render_pass, {depth.view()}, depth);
}

std::vector<std::uint32_t> view_masks(const gpu::Device& device, int views) {
  if (!device.identity().is_lavapipe()) return {(1u << views) - 1};
  std::vector<std::uint32_t> masks;
  masks.reserve(views);
  for (int view = 0; view < views; ++view) masks.push_back(1u << view);
  return masks;
}

gpu::RenderPassHandle make_render_pass(gpu::Device& device, const gpu::Image& colour, const gpu::Image& depth,
                                       const gpu::Image& target, std::uint32_t view_mask) {
  const bool multisampled = &colour != &target;
  constexpr auto kColour = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  std::vector<VkAttachmentDescription2> attachments{
      attachment(colour, VK_ATTACHMENT_LOAD_OP_CLEAR,
                 multisampled ? VK_ATTACHMENT_STORE_OP_DONT_CARE : VK_ATTACHMENT_STORE_OP_STORE, kColour),
      attachment(depth, VK_ATTACHMENT_LOAD_OP_CLEAR, VK_ATTACHMENT_STORE_OP_DONT_CARE, kDepth)};
  if (multisampled)
    attachments.push_back(attachment(target, VK_ATTACHMENT_LOAD_OP_DONT_CARE, VK_ATTACHMENT_STORE_OP_STORE, kColour));

  VkAttachmentReference2 colour_reference{VK_STRUCTURE_TYPE_ATTACHMENT_REFERENCE_2, nullptr, 0, kColour,
                                          VK_IMAGE_ASPECT_COLOR_BIT};
  VkAttachmentReference2 depth_reference{VK_STRUCTURE_TYPE_ATTACHMENT_REFERENCE_2, nullptr, 1, kDepth,
                                         VK_IMAGE_ASPECT_DEPTH_BIT};
  VkAttachmentReference2 resolve_reference{VK_STRUCTURE_TYPE_ATTACHMENT_REFERENCE_2, nullptr, 2, kColour,
                                           VK_IMAGE_ASPECT_COLOR_BIT};
  VkSubpassDescription2 subpass{VK_STRUCTURE_TYPE_SUBPASS_DESCRIPTION_2};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.viewMask = view_mask;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &colour_reference;
  subpass.pResolveAttachments = multisampled ? &resolve_reference : nullptr;
  subpass.pDepthStencilAttachment = &depth_reference;
  VkRenderPassCreateInfo2 create{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO_2};
  create.attachmentCount = static_cast<std::uint32_t>(attachments.size());
  create.pAttachments = attachments.data();
  create.subpassCount = 1;
  create.pSubpasses = &subpass;
  create.correlatedViewMaskCount = 1;
  create.pCorrelatedViewMasks = &view_mask;
  VkRenderPass render_pass = VK_NULL_HANDLE;
  gpu::check(vkCreateRenderPass2(device.handle(), &create, nullptr, &render_pass), "vkCreateRenderPass2");
  return {device.handle(), render_pass};
}

gpu::FramebufferHandle make_framebuffer(gpu::Device& device, VkRenderPass render_pass, const gpu::Image& colour,
                                        const gpu::Image& depth, const gpu::Image& target) {
  std::vector<VkImageView> views{colour.view(), depth.view()};
  if (&colour != &target) views.push_back(target.view());
  return framebuffer_of(device, render_pass, views, target);
}

void begin_render_pass(VkCommandBuffer commands, VkRenderPass render_pass, VkFramebuffer framebuffer,
                       VkExtent2D size) {
  const std::array<VkClearValue, 2> clear{};
  VkRenderPassBeginInfo begin{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
  begin.renderPass = render_pass;
  begin.framebuffer = framebuffer;
  begin.renderArea = {{0, 0}, size};
  begin.clearValueCount = clear.size();
  begin.pClearValues = clear.data();
  const VkSubpassBeginInfo inline_commands{VK_STRUCTURE_TYPE_SUBPASS_BEGIN_INFO};
  vkCmdBeginRenderPass2(commands, &begin, &inline_commands);
  // Negative height: clip space has +y up, as the camera has.
  const auto width = static_cast<float>(size.width);
  const auto height = static_cast<float>(size.height);
  const VkViewport viewport{0, height, width, -height, 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &begin.renderArea);
}

void hide(VkCommandBuffer commands, const VkRect2D& pixels) {
  if (pixels.extent.width == 0 || pixels.extent.height == 0) return;
  // Nearer than anything: every test of depth fails, before a fragment is shaded.
  VkClearAttachment nearest{};
  nearest.aspectMask = VK_IMAGE_ASPECT_DEPTH_BIT;
  nearest.clearValue.depthStencil.depth = 1;
  const VkClearRect where{pixels, 0, 1};
  vkCmdClearAttachments(commands, 1, &nearest, 1, &where);
}

}  // namespace stylet::render
