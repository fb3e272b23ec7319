#include "engine/render/renderer.h"

#include "engine/render/render_pass.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "shaders/background.frag.h"
#include "shaders/background.vert.h"
#include "shaders/deform.comp.h"
#include "shaders/fan.frag.h"
#include "shaders/surface.frag.h"
#include "shaders/surface.vert.h"

namespace stylet::render {

namespace {

constexpr VkFormat kColourFormat = VK_FORMAT_R8G8B8A8_SRGB;
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

/// Cells of the ground's grid along an edge of the picture; background.vert says why there is a grid.
int ground_cells(int pixels) {
  return (pixels + 63) / 64;
}

vec4 pack(const Eigen::Vector3d& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w)};
}

mat4 pack(const Eigen::Matrix4d& m) {
  mat4 columns;
  for (int i = 0; i < 16; ++i) columns[static_cast<std::size_t>(i)] = static_cast<float>(m(i % 4, i / 4));
  return columns;
}

template <typename T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

gpu::Buffer storage_buffer(gpu::Device& device, std::size_t bytes) {
  return {device, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT};
}

const RenderSettings& checked(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1)
    throw gpu::GpuError("3-D view of " + std::to_string(settings.width) + "x" + std::to_string(settings.height) +
                        "; choose at least 1x1");
  if (settings.views != 1 && settings.views != 2)
    throw gpu::GpuError("3-D view with " + std::to_string(settings.views) + " eyes; choose 1 or 2");
  return settings;
}

gpu::ImageSettings attachment(const RenderSettings& settings, VkFormat format, VkImageUsageFlags usage,
                              bool multisampled) {
  return {.width = static_cast<std::uint32_t>(settings.width),
          .height = static_cast<std::uint32_t>(settings.height),
          .layers = static_cast<std::uint32_t>(settings.views),
          .format = format,
          .usage = usage,
          .samples = multisampled ? VK_SAMPLE_COUNT_4_BIT : VK_SAMPLE_COUNT_1_BIT,
          .array_view = true};
}

/// Everything the surface pipelines have in common.
gpu::GraphicsSettings surface_pipeline(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings;
  settings.vertex = surface_vert;
  settings.fragment = surface_frag;
  settings.interface = {.slots = {gpu::Slot::uniform_buffer, gpu::Slot::storage_buffer, gpu::Slot::sampled_image},
                        .push_constant_bytes = sizeof(SurfaceStyle)};
  settings.render_pass = render_pass;
  settings.samples = antialias ? VK_SAMPLE_COUNT_4_BIT : VK_SAMPLE_COUNT_1_BIT;
  settings.cull = VK_CULL_MODE_BACK_BIT;
  settings.depth_test = true;
  settings.depth_write = true;
  return settings;
}

gpu::GraphicsSettings ground_pipeline(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = surface_pipeline(render_pass, antialias);
  settings.vertex = background_vert;
  settings.fragment = background_frag;
  settings.cull = VK_CULL_MODE_NONE;
  settings.depth_write = false;
  settings.depth_compare = VK_COMPARE_OP_GREATER_OR_EQUAL;  // where nothing was drawn the depth is 0, the ground's
  return settings;
}

gpu::GraphicsSettings fan_pipeline(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = surface_pipeline(render_pass, antialias);
  settings.fragment = fan_frag;
  settings.cull = VK_CULL_MODE_NONE;
  settings.depth_write = false;
  settings.blend = {gpu::Blend::premultiplied};
  return settings;
}

gpu::GraphicsSettings glass_depth_pipeline(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = surface_pipeline(render_pass, antialias);
  settings.fragment = {};
  settings.colour_write = false;
  return settings;
}

gpu::GraphicsSettings glass_colour_pipeline(VkRenderPass render_pass, bool antialias) {
  gpu::GraphicsSettings settings = surface_pipeline(render_pass, antialias);
  settings.depth_write = false;
  settings.depth_compare = VK_COMPARE_OP_EQUAL;
  settings.blend = {gpu::Blend::premultiplied};
  return settings;
}

}  // namespace

Renderer::Renderer(gpu::Device& device, const content::Scene& scene, const RenderSettings& settings)
    : device_(device),
      settings_(checked(settings)),
      probe_(scene.probe),
      geometry_(scene),
      nodes_(geometry_.rest_nodes),
      rest_(storage_buffer(device, bytes_of(geometry_.rest).size())),
      rest_nodes_(storage_buffer(device, bytes_of(nodes_).size())),
      current_nodes_(storage_buffer(device, bytes_of(nodes_).size())),
      drawn_(storage_buffer(device, (geometry_.rest.size() + geometry_.needle.vertex_count()) * sizeof(DrawnVertex))),
      indices_(device, bytes_of(geometry_.indices).size(), VK_BUFFER_USAGE_INDEX_BUFFER_BIT),
      frame_(device, sizeof(FrameUniforms), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT),
      target_(device, attachment(settings, kColourFormat, gpu::kTargetUsage, false)),
      depth_(device,
             attachment(settings, kDepthFormat, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, settings.antialias)),
      no_ultrasound_(device, {.format = VK_FORMAT_R8_UNORM}),
      sampler_(device),
      render_pass_([&] {
        if (settings.antialias)
          multisampled_.emplace(device,
                                attachment(settings, kColourFormat, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT, true));
        return make_render_pass(device, colour(), depth_, target_, static_cast<std::uint32_t>(settings.views));
      }()),
      framebuffer_(make_framebuffer(device, render_pass_.get(), colour(), depth_, target_)),
      deform_(device, deform_comp,
              {.slots = {gpu::Slot::storage_buffer, gpu::Slot::storage_buffer, gpu::Slot::storage_buffer,
                         gpu::Slot::storage_buffer, gpu::Slot::uniform_buffer},
               .push_constant_bytes = sizeof(DeformPush)}),
      ground_(device, ground_pipeline(render_pass_.get(), settings.antialias)),
      solid_(device, surface_pipeline(render_pass_.get(), settings.antialias)),
      fan_(device, fan_pipeline(render_pass_.get(), settings.antialias)),
      glass_depth_(device, glass_depth_pipeline(render_pass_.get(), settings.antialias)),
      glass_colour_(device, glass_colour_pipeline(render_pass_.get(), settings.antialias)),
      ring_(device),
      timestamps_(device, 4) {
  if (!scene.targets.empty()) focus_ = scene.targets.front().centre;
  gpu::run_now(device, [&](gpu::Commands& commands) {
    commands.upload(rest_, bytes_of(geometry_.rest));
    commands.upload(rest_nodes_, bytes_of(geometry_.rest_nodes));
    commands.upload(indices_, bytes_of(geometry_.indices));
    commands.upload(no_ultrasound_, std::as_bytes(std::span("\0", 1)));
  });
}

void Renderer::take_nodes(const state::FrameState& state) {
  std::size_t first = 0;
  for (std::size_t body = 0; body < geometry_.body_node_count.size(); ++body) {
    const std::size_t count = geometry_.body_node_count[body];
    if (body < state.bodies.size() && state.bodies[body].size() == count && count > 0)
      std::copy_n(state.bodies[body].front().data(), 3 * count, &nodes_[3 * first]);
    first += count;
  }
}

FrameUniforms Renderer::uniforms(const state::FrameState& state, const content::Camera& camera,
                                 const ViewOptions& options) const {
  FrameUniforms u{};
  Eigen::Vector3d between_eyes = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 2; ++i) {
    const Eye& eye = eyes_[std::min(i, eyes_.size() - 1)];
    u.clip_from_patient[i] = pack(eye.clip_from_patient);
    u.eye[i] = pack(eye.position, 1);
    between_eyes += eye.position / 2;
  }
  Eigen::Isometry3d patient_from_probe = Eigen::Isometry3d::Identity();
  patient_from_probe.translate(state.probe_position.cast<double>());
  patient_from_probe.rotate(state.probe_orientation.cast<double>().normalized());
  u.patient_from_probe = pack(patient_from_probe.matrix());
  u.probe_from_patient = pack(patient_from_probe.inverse().matrix());
  u.breath = {state.breath.x(), state.breath.y(), state.breath.z(), 0};

  // The lights are the photographer's: they stand where the camera stands.
  const Eigen::Vector3d back = (camera.eye - camera.look_at).normalized();
  Eigen::Vector3d right = camera.up.cross(back);
  right = right.norm() < 1e-9 ? back.unitOrthogonal() : Eigen::Vector3d(right.normalized());
  const Eigen::Vector3d up = back.cross(right);
  u.to_key = pack((-0.55 * right + 0.75 * up + 0.65 * back).normalized(), 1.25);
  u.to_fill = pack((0.85 * right - 0.15 * up + 0.55 * back).normalized(), 0.32);
  u.to_rim = pack((0.45 * right + 0.55 * up - 0.75 * back).normalized(), 1.1);

  const Eigen::Vector3d focus = focus_.value_or(camera.look_at);
  u.focus = pack(focus, settings_.window_radius);
  const Eigen::Vector3d towards_eyes = between_eyes - focus;
  u.focus_axis = pack(towards_eyes.normalized(), std::max(towards_eyes.norm(), 1e-3));
  u.fan = {static_cast<float>(probe_.convex ? probe_.radius : 0),
           static_cast<float>(probe_.convex ? probe_.field_of_view / 2 : probe_.width / 2),
           static_cast<float>(probe_.depth), probe_.convex ? 1.0F : 0.0F};
  if (options.plane.image != nullptr && options.plane.metres_per_pixel > 0) {
    const VkExtent3D size = options.plane.image->extent();
    u.fan_image = {static_cast<float>(options.plane.origin.x()), static_cast<float>(options.plane.origin.y()),
                   static_cast<float>(1 / (options.plane.metres_per_pixel * size.width)),
                   static_cast<float>(1 / (options.plane.metres_per_pixel * size.height))};
  }
  u.viewport = {static_cast<float>(settings_.width), static_cast<float>(settings_.height),
                static_cast<float>(ground_cells(settings_.width)),
                static_cast<float>(ground_cells(settings_.height))};
  return u;
}

std::vector<std::size_t> Renderer::glass_order() const {
  // By the distance of a piece's nearest point: what encloses another piece is nearer, and drawn after it.
  const Eigen::Vector3f eye = eyes_.front().position.cast<float>();
  std::vector<float> nearest;
  for (const Piece& piece : geometry_.glass) {
    float least = std::numeric_limits<float>::max();
    for (std::uint32_t i : piece.samples)
      least = std::min(least, (place(geometry_.rest[i], nodes_) - eye).squaredNorm());
    nearest.push_back(least);
  }
  std::vector<std::size_t> order(nearest.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return nearest[a] > nearest[b]; });
  return order;
}

const gpu::Image& Renderer::render(const state::FrameState& state, const content::Camera& camera,
                                   const ViewOptions& options) {
  eyes_ = eyes_of(camera, static_cast<double>(settings_.width) / settings_.height, settings_.views, settings_.stereo);
  return render_seen(state, camera, options);
}

const gpu::Image& Renderer::render(const state::FrameState& state, std::span<const EyeView> eyes,
                                   const ViewOptions& options) {
  if (eyes.size() != static_cast<std::size_t>(settings_.views))
    throw gpu::GpuError("3-D view of " + std::to_string(settings_.views) + " views with " +
                        std::to_string(eyes.size()) + " eyes; give one a view");
  eyes_.clear();
  for (const EyeView& view : eyes) {
    constexpr double kRightAngle = std::numbers::pi / 2;
    if (!(-kRightAngle < view.left && view.left < view.right && view.right < kRightAngle &&
          -kRightAngle < view.down && view.down < view.up && view.up < kRightAngle))
      throw gpu::GpuError("3-D view: an eye's field of view is empty or reaches behind it; check its angles");
    eyes_.push_back(eye_of(view));
  }
  const content::Camera ahead = camera_between(eyes, 1);
  return render_seen(state, camera_between(eyes, focus_ ? (*focus_ - ahead.eye).norm() : 1), options);
}

const gpu::Image& Renderer::render_seen(const state::FrameState& state, const content::Camera& camera,
                                        const ViewOptions& options) {
  take_nodes(state);
  const FrameUniforms frame = uniforms(state, camera, options);
  with_needle_ = geometry_.needle.fits(state.needle_positions.size(), state.needle_orientations.size());

  gpu::Commands& commands = ring_.next();
  timestamps_.reset(commands);
  timestamps_.mark(commands, "start");
  commands.upload(frame_, std::as_bytes(std::span(&frame, 1)));
  commands.upload(current_nodes_, bytes_of(nodes_));
  if (with_needle_)
    commands.upload(drawn_, std::as_bytes(geometry_.needle.shape(state.needle_positions, state.needle_orientations)),
                    geometry_.needle_base * sizeof(DrawnVertex));
  timestamps_.mark(commands, "upload");
  const auto count = static_cast<std::uint32_t>(geometry_.rest.size());
  commands.dispatch(deform_,
                    {gpu::read(0, rest_), gpu::read(1, rest_nodes_), gpu::read(2, current_nodes_),
                     gpu::write(3, drawn_), gpu::read(4, frame_)},
                    {(count + 63) / 64, 1, 1}, DeformPush{count});
  timestamps_.mark(commands, "deform");
  draw(commands, options.plane.image != nullptr ? *options.plane.image : no_ultrasound_, with_needle_);
  timestamps_.mark(commands, "draw");
  submission_ = commands.submit();
  return target_;
}

void Renderer::draw(gpu::Commands& commands, const gpu::Image& ultrasound, bool with_needle) const {
  const auto resources = {gpu::read(0, frame_), gpu::read(1, drawn_), gpu::sample(2, ultrasound, sampler_)};
  commands.prepare_draw(resources);
  commands.transition(indices_, gpu::kIndexRead);
  commands.transition(depth_, gpu::kDepthAttachment, true);
  commands.transition(target_, gpu::kColourAttachment, true);
  if (multisampled_) commands.transition(*multisampled_, gpu::kColourAttachment, true);

  const VkCommandBuffer cmd = commands.handle();
  begin_render_pass(cmd, render_pass_.get(), framebuffer_.get(),
                    {static_cast<std::uint32_t>(settings_.width), static_cast<std::uint32_t>(settings_.height)});
  vkCmdBindIndexBuffer(cmd, indices_.handle(), 0, VK_INDEX_TYPE_UINT32);

  const auto draw_piece = [&](const gpu::GraphicsPipeline& pipeline, const Piece& piece) {
    commands.bind(pipeline, resources, piece.style);
    vkCmdDrawIndexed(cmd, piece.index_count, 1, piece.first_index, 0, 0);
  };
  for (const Piece& piece : geometry_.solids) draw_piece(solid_, piece);
  if (with_needle)
    for (const Piece& piece : geometry_.needle_pieces) draw_piece(solid_, piece);
  commands.bind(ground_, resources, SurfaceStyle{});
  vkCmdDraw(cmd, static_cast<std::uint32_t>(6 * ground_cells(settings_.width) * ground_cells(settings_.height)), 1, 0,
            0);
  draw_piece(fan_, geometry_.fan);
  for (std::size_t i : glass_order()) {
    draw_piece(glass_depth_, geometry_.glass[i]);
    draw_piece(glass_colour_, geometry_.glass[i]);
  }
  // Skin, fat and muscle are one shell: of all of them together only the nearest surface is seen.
  for (const Piece& piece : geometry_.covers) draw_piece(glass_depth_, piece);
  for (const Piece& piece : geometry_.covers) draw_piece(glass_colour_, piece);
  const VkSubpassEndInfo end{VK_STRUCTURE_TYPE_SUBPASS_END_INFO};
  vkCmdEndRenderPass2(cmd, &end);
}

ViewLabels Renderer::read_labels(std::uint32_t layer) {
  if (!labels_) labels_.emplace(device_, settings_.width, settings_.height, settings_.views);
  labels_->draw(geometry_, frame_, drawn_, indices_, with_needle_);
  return labels_->read(layer);
}

std::vector<gpu::Timestamps::Span> Renderer::stage_times() const {
  device_.wait(submission_);
  return timestamps_.read();
}

}  // namespace stylet::render
