// The one render pass of the 3-D view.
#pragma once

#include "engine/gpu/image.h"

#include <cstdint>
#include <vector>

namespace stylet::render {

/// View masks of the passes that draw all views: one of all of them (multiview). Mesa's software rasteriser draws
/// clipped triangles of one view into another (seen with 22.3.6), so there each view has a pass of its own.
std::vector<std::uint32_t> view_masks(const gpu::Device& device, int views);

/// The views of a mask at once (multiview): colour and depth, resolved if multisampled. Images enter and leave in
/// their attachment layouts, put there by the tracker of gpu::Image. A VkRenderPass and not dynamic rendering: the
/// synchronisation validation of Debian 12 sees hazards on the attachments of the one and not of the other.
/// @param colour  multisampled, or the same image as `target`
gpu::RenderPassHandle make_render_pass(gpu::Device& device, const gpu::Image& colour, const gpu::Image& depth,
                                       const gpu::Image& target, std::uint32_t view_mask);

gpu::FramebufferHandle make_framebuffer(gpu::Device& device, VkRenderPass render_pass, const gpu::Image& colour,
                                        const gpu::Image& depth, const gpu::Image& target);

/// Depth alone, of one view, kept for who samples it.
gpu::RenderPassHandle make_depth_pass(gpu::Device& device, const gpu::Image& depth);
gpu::FramebufferHandle make_framebuffer(gpu::Device& device, VkRenderPass render_pass, const gpu::Image& depth);

/// Begins the pass over a whole framebuffer, cleared to nothing, infinitely far away (reversed depth: 0); all of it
/// is drawn to, +y up as the camera has it.
void begin_render_pass(VkCommandBuffer commands, VkRenderPass render_pass, VkFramebuffer framebuffer,
                       VkExtent2D size);

/// In a pass that has begun: nothing is drawn there from now on. No pixels: does nothing.
void hide(VkCommandBuffer commands, const VkRect2D& pixels);

}  // namespace stylet::render
