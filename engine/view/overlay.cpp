#include "engine/view/overlay.h"

#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <filesystem>

namespace stylet::view {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr float kFontSize = 15;  // pixels at scale 1
constexpr std::uint32_t kBufferedFrames = 3;

/// Latin with the letters of Europe's names, Greek, Cyrillic, dashes and quotes, arrows, mathematical signs.
constexpr std::array<ImWchar, 13> kGlyphs{0x20,   0x17F,  0x391,  0x3C9,  0x400,  0x45F, 0x2010,
                                          0x2027, 0x2190, 0x2193, 0x2248, 0x2265, 0};

/// The attachment is sRGB, so what the shader writes is linear; Dear ImGui's colours mean sRGB.
ImVec4 linear(const ImVec4& srgb) {
  const auto one = [](float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); };
  return {one(srgb.x), one(srgb.y), one(srgb.z), srgb.w};
}

void set_style(double scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.WindowBorderSize = 0;
  style.WindowPadding = {12, 10};
  style.Colors[ImGuiCol_WindowBg] = {0.07F, 0.09F, 0.11F, 0.86F};
  style.Colors[ImGuiCol_Text] = {0.90F, 0.93F, 0.95F, 1};
  style.Colors[ImGuiCol_TitleBg] = style.Colors[ImGuiCol_TitleBgActive] = {0.10F, 0.14F, 0.17F, 0.95F};
  style.Colors[ImGuiCol_Button] = style.Colors[ImGuiCol_FrameBg] = {0.17F, 0.25F, 0.30F, 1};
  style.Colors[ImGuiCol_ButtonHovered] = style.Colors[ImGuiCol_FrameBgHovered] = {0.22F, 0.36F, 0.43F, 1};
  style.Colors[ImGuiCol_ButtonActive] = style.Colors[ImGuiCol_FrameBgActive] = {0.25F, 0.46F, 0.55F, 1};
  style.Colors[ImGuiCol_SliderGrab] = style.Colors[ImGuiCol_CheckMark] = {0.42F, 0.78F, 0.86F, 1};
  style.Colors[ImGuiCol_SliderGrabActive] = {0.60F, 0.90F, 0.96F, 1};
  style.Colors[ImGuiCol_PlotHistogram] = {0.42F, 0.78F, 0.86F, 1};
  for (ImVec4& colour : style.Colors) colour = linear(colour);
  style.ScaleAllSizes(static_cast<float>(scale));
}

/// Over what is there: loaded, drawn, stored.
gpu::RenderPassHandle make_pass(gpu::Device& device, VkFormat format) {
  VkAttachmentDescription attachment{};
  attachment.format = format;
  attachment.samples = VK_SAMPLE_COUNT_1_BIT;
  attachment.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
  attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  attachment.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  attachment.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  attachment.initialLayout = attachment.finalLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  const VkAttachmentReference reference{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &reference;
  VkRenderPassCreateInfo create{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
  create.attachmentCount = 1;
  create.pAttachments = &attachment;
  create.subpassCount = 1;
  create.pSubpasses = &subpass;
  VkRenderPass pass = VK_NULL_HANDLE;
  gpu::check(vkCreateRenderPass(device.handle(), &create, nullptr, &pass), "vkCreateRenderPass");
  return {device.handle(), pass};
}

gpu::DescriptorPoolHandle make_descriptors(gpu::Device& device) {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 4};
  VkDescriptorPoolCreateInfo create{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
  create.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
  create.maxSets = size.descriptorCount;
  create.poolSizeCount = 1;
  create.pPoolSizes = &size;
  VkDescriptorPool pool = VK_NULL_HANDLE;
  gpu::check(vkCreateDescriptorPool(device.handle(), &create, nullptr, &pool), "vkCreateDescriptorPool");
  return {device.handle(), pool};
}

}  // namespace

Overlay::Context::Context(double scale) : context(ImGui::CreateContext()) {
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // sessions begin alike
  io.ConfigWindowsMoveFromTitleBarOnly = true;
  if (std::filesystem::exists(kFont)) {
    io.Fonts->AddFontFromFileTTF(kFont, std::round(kFontSize * static_cast<float>(scale)), nullptr, kGlyphs.data());
  }
  set_style(scale);
}

Overlay::Context::~Context() {
  ImGui::DestroyContext(context);
}

OverlayFrame overlay_frame(const Input& input, int width, int height, double dt_s) {
  return {.width = width,
          .height = height,
          .dt_s = dt_s,
          .pointer_x = input.pointer_x,
          .pointer_y = input.pointer_y,
          .left = input.left,
          .right = input.right,
          .wheel = input.wheel};
}

Overlay::Overlay(gpu::Device& device, VkFormat format, double scale)
    : device_(device),
      scale_(scale),
      context_(scale),
      render_pass_(make_pass(device, format)),
      descriptors_(make_descriptors(device)) {
  ImGui_ImplVulkan_InitInfo init{};
  init.Instance = device.instance();
  init.PhysicalDevice = device.physical();
  init.Device = device.handle();
  init.QueueFamily = device.queue_family();
  init.Queue = device.queue();
  init.DescriptorPool = descriptors_.get();
  init.MinImageCount = init.ImageCount = kBufferedFrames;
  init.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
  init.CheckVkResultFn = [](VkResult result) { gpu::check(result, "Dear ImGui"); };
  ImGui_ImplVulkan_Init(&init, render_pass_.get());
  try {
    gpu::run_now(device, [](gpu::Commands& commands) { ImGui_ImplVulkan_CreateFontsTexture(commands.handle()); });
  } catch (...) {
    ImGui_ImplVulkan_Shutdown();
    throw;
  }
  ImGui_ImplVulkan_DestroyFontUploadObjects();
}

Overlay::~Overlay() {
  device_.settle();
  ImGui_ImplVulkan_Shutdown();
}

void Overlay::begin(const OverlayFrame& frame) {
  if (begun_) ImGui::EndFrame();
  begun_ = true;
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {static_cast<float>(frame.width), static_cast<float>(frame.height)};
  io.DeltaTime = std::max(static_cast<float>(frame.dt_s), 1e-4F);
  const bool pointer = frame.pointer_x >= 0 && frame.pointer_y >= 0;
  io.MousePos = pointer ? ImVec2(static_cast<float>(frame.pointer_x), static_cast<float>(frame.pointer_y))
                        : ImVec2(-FLT_MAX, -FLT_MAX);
  io.MouseDown[ImGuiMouseButton_Left] = frame.left;
  io.MouseDown[ImGuiMouseButton_Right] = frame.right;
  io.MouseWheel = static_cast<float>(frame.wheel);
  ImGui_ImplVulkan_NewFrame();
  ImGui::NewFrame();
}

bool Overlay::wants_pointer() const {
  return ImGui::GetIO().WantCaptureMouse;
}

void Overlay::draw(gpu::Commands& commands, const gpu::Image& target) {
  begun_ = false;
  ImGui::Render();
  gpu::FramebufferHandle& framebuffer = framebuffers_[target.view()];
  const VkExtent2D size{target.settings().width, target.settings().height};
  if (!framebuffer) {
    const VkImageView view = target.view();
    VkFramebufferCreateInfo create{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
    create.renderPass = render_pass_.get();
    create.attachmentCount = 1;
    create.pAttachments = &view;
    create.width = size.width;
    create.height = size.height;
    create.layers = 1;
    VkFramebuffer made = VK_NULL_HANDLE;
    gpu::check(vkCreateFramebuffer(device_.handle(), &create, nullptr, &made), "vkCreateFramebuffer");
    framebuffer = gpu::FramebufferHandle(device_.handle(), made);
  }
  commands.transition(target, gpu::kColourAttachment);
  VkRenderPassBeginInfo pass{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
  pass.renderPass = render_pass_.get();
  pass.framebuffer = framebuffer.get();
  pass.renderArea = {{0, 0}, size};
  vkCmdBeginRenderPass(commands.handle(), &pass, VK_SUBPASS_CONTENTS_INLINE);
  ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands.handle());
  vkCmdEndRenderPass(commands.handle());
}

}  // namespace stylet::view
