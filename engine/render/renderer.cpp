#include "engine/render/renderer.h"

#include "engine/render/frame_uniforms.h"
#include "engine/render/render_pass.h"
#include "engine/state/biopsy_shot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "shaders/deform.comp.h"

namespace stylet::render {

namespace {

constexpr VkFormat kColourFormat = VK_FORMAT_R8G8B8A8_SRGB;
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

/// Cells of the ground's grid along an edge of the picture; background.vert says why there is a grid.
int ground_cells(int pixels) {
  return (pixels + 63) / 64;
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

gpu::ImageSettings target_settings(const RenderSettings& settings) {
  return attachment(settings, kColourFormat, gpu::kTargetUsage, false);
}

gpu::ImageSettings multisampled_settings(const RenderSettings& settings) {
  return attachment(settings, kColourFormat, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT, true);
}

gpu::ImageSettings depth_settings(const RenderSettings& settings) {
  return attachment(settings, kDepthFormat, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, settings.antialias);
}

/// Sampling an sRGB image decodes it, sampling a plain one does not.
std::uint32_t picture_kind(const gpu::Image* picture) {
  if (picture == nullptr) return kNoPicture;
  return picture->format() == VK_FORMAT_R8G8B8A8_SRGB ? kPicture : kEncodedPicture;
}

Eigen::Isometry3d pose_of_probe(const state::FrameState& state) {
  Eigen::Isometry3d patient_from_probe = Eigen::Isometry3d::Identity();
  patient_from_probe.translate(state.probe_position.cast<double>());
  patient_from_probe.rotate(state.probe_orientation.cast<double>().normalized());
  return patient_from_probe;
}

}  // namespace

Geometry geometry_of(const content::Scene& scene, const RenderSettings& settings) {
  const RoomLayout layout = room_layout(scene);
  return Geometry(scene, settings.room ? &layout : nullptr, settings.detail);
}

Renderer::Renderer(gpu::Device& device, const content::Scene& scene, const RenderSettings& settings)
    : Renderer(device, scene, settings, geometry_of(scene, settings)) {}

Renderer::Renderer(gpu::Device& device, const content::Scene& scene, const RenderSettings& settings,
                   Geometry geometry)
    : device_(device),
      settings_(checked(settings)),
      layout_(room_layout(scene)),
      probe_(scene.probe),
      patient_(scene.labels),
      geometry_(std::move(geometry)),
      rest_(storage_buffer(device, bytes_of(geometry_.rest).size())),
      rest_nodes_(storage_buffer(device, bytes_of(geometry_.rest_nodes).size())),
      current_nodes_(storage_buffer(device, bytes_of(geometry_.rest_nodes).size())),
      drawn_(storage_buffer(device, geometry_.vertex_count() * sizeof(DrawnVertex))),
      indices_(device, bytes_of(geometry_.indices).size(), VK_BUFFER_USAGE_INDEX_BUFFER_BIT),
      frame_(device, sizeof(FrameUniforms), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT),
      target_(device, target_settings(settings)),
      depth_(device, depth_settings(settings)),
      black_(device, {.format = VK_FORMAT_R8_UNORM}),
      sampler_(device),
      deform_(device, deform_comp,
              {.slots = {gpu::Slot::storage_buffer, gpu::Slot::storage_buffer, gpu::Slot::storage_buffer,
                         gpu::Slot::storage_buffer, gpu::Slot::uniform_buffer},
               .push_constant_bytes = sizeof(DeformPush)}),
      shadow_(device, settings.shadows),
      ring_(device),
      timestamps_(device, 5) {
  if (settings.antialias) multisampled_.emplace(device, multisampled_settings(settings));
  for (const std::uint32_t mask : view_masks(device, settings.views)) {
    gpu::RenderPassHandle pass = make_render_pass(device, colour(), depth_, target_, mask);
    SurfacePipelines pipelines(device, pass.get(), settings.antialias, settings.room);
    passes_.push_back({std::move(pass), {}, std::move(pipelines)});
  }
  make_framebuffers();
  if (!scene.targets.empty()) focus_ = scene.targets.front().centre;
  gpu::run_now(device, [&](gpu::Commands& commands) {
    commands.upload(rest_, bytes_of(geometry_.rest));
    commands.upload(rest_nodes_, bytes_of(geometry_.rest_nodes));
    commands.upload(indices_, bytes_of(geometry_.indices));
    commands.upload(black_, std::as_bytes(std::span("\0", 1)));
  });
}

void Renderer::make_framebuffers() {
  for (Pass& pass : passes_)
    pass.framebuffer = make_framebuffer(device_, pass.render_pass.get(), colour(), depth_, target_);
}

void Renderer::resize(int width, int height) {
  RenderSettings settings = settings_;
  settings.width = width;
  settings.height = height;
  settings_ = checked(settings);
  device_.wait_idle();
  labels_.reset();
  shown_.reset();
  for (Pass& pass : passes_) pass.framebuffer = {};
  target_ = gpu::Image(device_, target_settings(settings_));
  depth_ = gpu::Image(device_, depth_settings(settings_));
  if (multisampled_) multisampled_ = gpu::Image(device_, multisampled_settings(settings_));
  make_framebuffers();
}

void Renderer::find_bodies(const state::FrameState& state) {
  std::size_t first = 0;
  bodies_.clear();
  for (const std::size_t count : geometry_.body_node_count) {
    const std::size_t body = bodies_.size();
    const bool known = body < state.bodies.size() && state.bodies[body].size() == count;
    bodies_.push_back(known ? std::span(state.bodies[body]) : std::span(geometry_.rest_nodes).subspan(first, count));
    first += count;
  }
}

/// From the state to where the GPU fetches them, without a stop between.
void Renderer::take_nodes(gpu::Commands& commands) {
  const std::span<std::byte> staged = commands.upload_later(current_nodes_, bytes_of(geometry_.rest_nodes).size());
  std::size_t first = 0;
  for (const std::span<const Eigen::Vector3f> body : bodies_) {
    std::ranges::copy(std::as_bytes(body), staged.subspan(first * sizeof(Eigen::Vector3f)).begin());
    first += body.size();
  }
}

void Renderer::take_zone(gpu::Commands& commands, const content::HeatedZone* zone) {
  const std::uint64_t version = zone != nullptr && geometry_.zone_room > 0 ? zone->version : 0;
  if (version == zone_version_) return;
  zone_version_ = version;
  zone_ = version > 0 ? zone_geometry(*zone, geometry_) : ZoneGeometry{};
  if (zone_.indices.empty()) return;
  std::ranges::copy(zone_.rest, geometry_.rest.begin() + geometry_.zone_base);
  commands.upload(rest_, bytes_of(zone_.rest), geometry_.zone_base * sizeof(RestVertex));
  commands.upload(indices_, bytes_of(zone_.indices), zone_.piece.first_index * sizeof(std::uint32_t));
}

std::vector<std::pair<float, const Piece*>> Renderer::by_distance(std::span<const Piece> pieces) const {
  const Eigen::Vector3f eye = eyes_.front().position.cast<float>();
  std::vector<std::pair<float, const Piece*>> order;
  for (const Piece& piece : pieces) {
    float least = std::numeric_limits<float>::max();
    for (std::uint32_t i : piece.samples)
      least = std::min(least, (place(geometry_.rest[i], bodies_) - eye).squaredNorm());
    order.emplace_back(least, &piece);
  }
  return order;
}

std::vector<const Piece*> Renderer::glass_order() const {
  // What encloses another piece is nearer, and drawn after it.
  std::vector<std::pair<float, const Piece*>> pieces = by_distance(geometry_.glass);
  if (zone_.piece.index_count > 0) pieces.push_back(by_distance(std::span(&zone_.piece, 1)).front());
  if (with_shot_) std::ranges::copy(by_distance(geometry_.glass_targets), std::back_inserter(pieces));
  std::ranges::stable_sort(pieces, std::greater(), &std::pair<float, const Piece*>::first);
  std::vector<const Piece*> order;
  order.reserve(pieces.size());
  for (const auto& [nearest, piece] : pieces) order.push_back(piece);
  return order;
}

std::vector<const Piece*> Renderer::solids_order() const {
  // The probe, which rides on its own pose, has no samples and is the last of them as they stand: nothing is before
  // it.
  std::vector<std::pair<float, const Piece*>> pieces = by_distance(geometry_.solids);
  pieces.back().first = 0;
  std::ranges::stable_sort(pieces, std::less(), &std::pair<float, const Piece*>::first);
  std::vector<const Piece*> order;
  order.reserve(pieces.size());
  for (const auto& [nearest, piece] : pieces) {
    if (!(with_shot_ && piece->target)) order.push_back(piece);
  }
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
  FrameUniforms frame = frame_uniforms(state, eyes_, layout_, geometry_.cavity_rings, probe_,
                                       focus_.value_or(camera.look_at), settings_.window_radius, options);
  frame.shadow = shadow_.uniform();
  const std::vector<float> reaches = fan_reach(patient_, probe_, pose_of_probe(state));
  for (std::size_t i = 0; i < reaches.size(); ++i) frame.fan_reach[i / 4][i % 4] = reaches[i];
  frame.viewport = {static_cast<float>(settings_.width), static_cast<float>(settings_.height),
                    static_cast<float>(ground_cells(settings_.width)),
                    static_cast<float>(ground_cells(settings_.height))};
  with_needle_ = geometry_.needle.fits(state.needle_positions.size(), state.needle_orientations.size());
  with_panel_ = options.panel != nullptr && geometry_.panel_picture.index_count > 0;
  with_syringe_ = with_needle_ && state.syringe && geometry_.syringe.vertex_count() > 0;
  see_through_ = options.see_through;
  find_bodies(state);
  // The needle is latched last; but where nothing else has moved, now, to see whether it is to be drawn, or its
  // shadow.
  const auto latch = [&] {
    if (!with_needle_) return;
    needle_positions_ = state.needle_positions;
    needle_orientations_ = state.needle_orientations;
    if (options.latch_needle) options.latch_needle({needle_positions_, needle_orientations_});
  };
  Casters casters = casters_of(state);
  const bool others_stand = casters_ && casters.as_but_for_the_needle(*casters_);
  if (others_stand) {
    latch();
    take_needle(casters);
  }
  std::optional<Shown> shown;
  if (options.pictures) {
    shown = {.frame = frame,
             .cores = state.cores,
             .shot = state::shot_of(state),
             .zone = state.zone != nullptr ? state.zone->version : 0,
             .plane = options.plane.image,
             .screen = options.screen,
             .panel = options.panel,
             .pictures = *options.pictures,
             .hands = {options.needle_hand, options.probe_hand},
             .hidden = options.hidden};
  }
  drawn_anew_ = !still_shows(casters, shown);
  if (!drawn_anew_) return target_;
  ++frames_drawn_;
  shown_ = std::move(shown);

  gpu::Commands& commands = ring_.next();
  timestamps_.reset(commands);
  timestamps_.mark(commands, "start");
  commands.upload(frame_, std::as_bytes(std::span(&frame, 1)));
  take_nodes(commands);
  take_zone(commands, state.zone.get());
  if (geometry_.cable) {
    commands.upload(drawn_, std::as_bytes(geometry_.cable->shape(pose_of_probe(state))),
                    geometry_.cable_base * sizeof(DrawnVertex));
  }
  cores_ = std::min(state.cores.size(), Geometry::kMostCores);
  if (cores_ > 0)
    commands.upload(drawn_, std::as_bytes(geometry_.cores.shape(core_rods(state.cores))),
                    geometry_.core_base * sizeof(DrawnVertex));
  with_hands_ = {options.needle_hand.has_value(), options.probe_hand.has_value()};
  if (with_hands_[0] || with_hands_[1]) {
    std::vector<Rod> rods;
    for (const auto& hand : {options.needle_hand, options.probe_hand}) {
      const auto parts = controller_rods(hand.value_or(Eigen::Isometry3d::Identity()));
      rods.insert(rods.end(), parts.begin(), parts.end());
    }
    commands.upload(drawn_, std::as_bytes(geometry_.hands.shape(rods)), geometry_.hand_base * sizeof(DrawnVertex));
  }
  std::span<std::byte> syringe;
  if (with_syringe_)
    syringe = commands.upload_later(drawn_, geometry_.syringe.vertex_count() * sizeof(DrawnVertex),
                                    geometry_.syringe_base * sizeof(DrawnVertex));
  const std::optional<state::BiopsyShot> shot = with_needle_ ? state::shot_of(state) : std::nullopt;
  with_shot_ = shot.has_value();
  std::span<std::byte> stylet;
  if (with_shot_)
    stylet = commands.upload_later(drawn_, geometry_.shot.vertex_count() * sizeof(DrawnVertex),
                                   geometry_.shot_base * sizeof(DrawnVertex));
  std::span<std::byte> needle;
  if (with_needle_)
    needle = commands.upload_later(drawn_, geometry_.needle.vertex_count() * sizeof(DrawnVertex),
                                   geometry_.needle_base * sizeof(DrawnVertex));
  timestamps_.mark(commands, "upload");
  const auto count = static_cast<std::uint32_t>(geometry_.rest.size() - geometry_.zone_room + zone_.rest.size());
  commands.dispatch(deform_,
                    {gpu::read(0, rest_), gpu::read(1, rest_nodes_), gpu::read(2, current_nodes_),
                     gpu::write(3, drawn_), gpu::read(4, frame_)},
                    {(count + 63) / 64, 1, 1}, DeformPush{count});
  timestamps_.mark(commands, "deform");
  if (!others_stand || casters != *casters_) {
    shadow_.draw(commands, geometry_, frame_, drawn_, indices_,
                 {.needle = with_needle_, .syringe = with_syringe_, .drape = see_through_ != SeeThrough::glass});
    ++shadows_drawn_;
  }
  timestamps_.mark(commands, "shadow");
  draw(commands, options);
  timestamps_.mark(commands, "draw");
  if (!others_stand) {
    latch();
    take_needle(casters);
  }
  if (with_needle_) {
    std::ranges::copy(std::as_bytes(geometry_.needle.shape(needle_positions_, needle_orientations_)), needle.begin());
    if (with_syringe_)
      std::ranges::copy(std::as_bytes(geometry_.syringe.shape(
                            syringe_rods(*state.syringe, needle_positions_.front(), needle_orientations_.front()))),
                        syringe.begin());
    if (shot)
      std::ranges::copy(
          std::as_bytes(geometry_.shot.shape(
              shot_rods(*shot, needle_positions_.back(), needle_orientations_.back(), geometry_.needle.radius()))),
          stylet.begin());
  }
  casters_ = std::move(casters);
  submission_ = commands.submit();
  return target_;
}

Renderer::Casters Renderer::casters_of(const state::FrameState& state) const {
  Casters casters{.probe_position = state.probe_position,
                  .probe_orientation = state.probe_orientation.coeffs(),
                  .breath = state.breath};
  for (const std::span<const Eigen::Vector3f> body : bodies_)
    casters.nodes.insert(casters.nodes.end(), body.begin(), body.end());
  if (with_syringe_) casters.syringe = state.syringe->held;
  casters.drape = see_through_ != SeeThrough::glass;
  return casters;
}

void Renderer::take_needle(Casters& casters) const {
  if (!with_needle_) return;
  casters.needle_positions = needle_positions_;
  for (const Eigen::Quaternionf& orientation : needle_orientations_)
    casters.needle_orientations.push_back(orientation.coeffs());
}

bool Renderer::Casters::as_but_for_the_needle(const Casters& other) const {
  return nodes == other.nodes && probe_position == other.probe_position &&
         probe_orientation == other.probe_orientation && breath == other.breath && syringe == other.syringe &&
         drape == other.drape;
}

bool Renderer::Shown::same_as(const Shown& other) const {
  const auto rectangle = [](const VkRect2D& r) {
    return std::array<std::int64_t, 4>{r.offset.x, r.offset.y, r.extent.width, r.extent.height};
  };
  const auto hand = [](const std::optional<Eigen::Isometry3d>& pose) {
    return pose ? std::optional<Eigen::Matrix4d>(pose->matrix()) : std::nullopt;
  };
  return std::memcmp(&frame, &other.frame, sizeof(FrameUniforms)) == 0 && shot == other.shot && zone == other.zone &&
         plane == other.plane && screen == other.screen && panel == other.panel && pictures == other.pictures &&
         rectangle(hidden) == rectangle(other.hidden) && std::ranges::equal(hands, other.hands, {}, hand, hand) &&
         std::ranges::equal(cores, other.cores, [](const state::CoreTrack& a, const state::CoreTrack& b) {
           return a.from == b.from && a.to == b.to && a.radius == b.radius;
         });
}

bool Renderer::still_shows(const Casters& casters, const std::optional<Shown>& shown) const {
  return shown && shown_ && casters_ && casters == *casters_ && shown->same_as(*shown_);
}

void Renderer::draw(gpu::Commands& commands, const ViewOptions& options) const {
  for (const Pass& pass : passes_) draw(commands, options, pass);
}

void Renderer::draw(gpu::Commands& commands, const ViewOptions& options, const Pass& pass) const {
  const gpu::Image& ultrasound = options.plane.image != nullptr ? *options.plane.image : black_;
  const gpu::Image& screen = options.screen != nullptr ? *options.screen : black_;
  const auto resources = {gpu::read(0, frame_), gpu::read(1, drawn_), gpu::sample(2, ultrasound, sampler_),
                          gpu::sample(3, screen, sampler_), gpu::sample(4, shadow_.map(), shadow_.sampler())};
  // The panel's picture stands where the screen's does.
  const auto panel_resources = {gpu::read(0, frame_), gpu::read(1, drawn_), gpu::sample(2, ultrasound, sampler_),
                                gpu::sample(3, options.panel != nullptr ? *options.panel : black_, sampler_),
                                gpu::sample(4, shadow_.map(), shadow_.sampler())};
  commands.prepare_draw(resources);
  commands.prepare_draw(panel_resources);
  commands.transition(indices_, gpu::kIndexRead);
  const bool first = &pass == passes_.data();  // the others keep what it has drawn
  commands.transition(depth_, gpu::kDepthAttachment, first);
  commands.transition(target_, gpu::kColourAttachment, first);
  if (multisampled_) commands.transition(*multisampled_, gpu::kColourAttachment, first);

  const VkCommandBuffer cmd = commands.handle();
  begin_render_pass(cmd, pass.render_pass.get(), pass.framebuffer.get(),
                    {static_cast<std::uint32_t>(settings_.width), static_cast<std::uint32_t>(settings_.height)});
  if (settings_.views == 1) hide(cmd, options.hidden);
  vkCmdBindIndexBuffer(cmd, indices_.handle(), 0, VK_INDEX_TYPE_UINT32);

  const auto draw_piece = [&](const gpu::GraphicsPipeline& pipeline, const Piece& piece) {
    SurfaceStyle style = piece.style;
    if (style.kind[0] == kScreen) style.kind[2] = picture_kind(options.screen);
    commands.bind(pipeline, resources, style);
    vkCmdDrawIndexed(cmd, piece.index_count, 1, piece.first_index, 0, 0);
  };
  const auto draw_pieces = [&](const std::vector<Piece>& pieces) {
    for (const Piece& piece : pieces) draw_piece(pass.pipelines.surface(piece.style.kind[0]), piece);
  };
  // What hides most comes first.
  if (see_through_ != SeeThrough::glass) {
    for (const Piece& piece : geometry_.drape) draw_piece(pass.pipelines.depth(kCloth), piece);
    draw_pieces(geometry_.drape);
  }
  if (with_needle_) draw_pieces(geometry_.needle_pieces);
  if (with_shot_) draw_piece(pass.pipelines.surface(kSteel), geometry_.shot_piece);
  if (with_syringe_) draw_pieces(geometry_.syringe_pieces);
  // Closed skin hides the organs, and all that is spared would have to be rasterised.
  const bool closed = see_through_ == SeeThrough::closed && !geometry_.covers.empty();
  if (closed) {
    draw_piece(pass.pipelines.surface(kMatte), geometry_.probe());
  } else {
    for (const Piece* piece : solids_order()) draw_piece(pass.pipelines.surface(piece->style.kind[0]), *piece);
    if (cores_ > 0) draw_piece(pass.pipelines.surface(kMatte), geometry_.first_cores(cores_));
  }
  if (see_through_ == SeeThrough::window) draw_pieces(geometry_.cavity);
  draw_pieces(geometry_.room);
  if (with_panel_) {
    draw_pieces(geometry_.panel);
    const Piece& picture = geometry_.panel_picture;
    SurfaceStyle style = picture.style;
    style.kind[2] = picture_kind(options.panel);
    commands.bind(pass.pipelines.surface(kScreen), panel_resources, style);
    vkCmdDrawIndexed(cmd, picture.index_count, 1, picture.first_index, 0, 0);
  }
  if (geometry_.cable) draw_piece(pass.pipelines.surface(kMatte), geometry_.cable_piece);
  for (std::size_t i = 0; i < 2; ++i) {
    if (with_hands_[i]) draw_piece(pass.pipelines.surface(kMatte), geometry_.hand_pieces[i]);
  }
  commands.bind(pass.pipelines.ground(), resources, SurfaceStyle{});
  vkCmdDraw(cmd, static_cast<std::uint32_t>(6 * ground_cells(settings_.width) * ground_cells(settings_.height)), 1, 0,
            0);
  draw_piece(pass.pipelines.fan(), geometry_.fan);
  for (const Piece* piece : closed ? std::vector<const Piece*>{} : glass_order()) {
    draw_piece(pass.pipelines.depth(kGlass), *piece);
    draw_piece(pass.pipelines.surface(kGlass), *piece);
  }
  if (with_syringe_) {
    draw_piece(pass.pipelines.depth(kGlass), geometry_.barrel);
    draw_piece(pass.pipelines.surface(kGlass), geometry_.barrel);
  }
  // Skin, fat and muscle are one shell: of all of them together only the nearest surface is seen.
  std::vector<const Piece*> shell;
  for (const Piece& piece : geometry_.covers) shell.push_back(&piece);
  if (see_through_ != SeeThrough::glass)
    for (const Piece& piece : geometry_.lining) shell.push_back(&piece);
  for (const Piece* piece : shell) draw_piece(pass.pipelines.depth(kCover), *piece);
  for (const Piece* piece : shell) draw_piece(pass.pipelines.surface(kCover), *piece);
  const VkSubpassEndInfo end{VK_STRUCTURE_TYPE_SUBPASS_END_INFO};
  vkCmdEndRenderPass2(cmd, &end);
}

ViewLabels Renderer::read_labels(std::uint32_t layer) {
  if (!labels_) labels_.emplace(device_, settings_.width, settings_.height, settings_.views);
  labels_->draw(geometry_, frame_, drawn_, indices_,
                {.needle = with_needle_,
                 .syringe = with_syringe_,
                 .shot = with_shot_,
                 .cores = cores_,
                 .panel = with_panel_,
                 .see_through = see_through_});
  return labels_->read(layer);
}

std::vector<gpu::Timestamps::Span> Renderer::stage_times() const {
  if (!drawn_anew_) return {};
  device_.wait(submission_);
  return timestamps_.read();
}

}  // namespace stylet::render
