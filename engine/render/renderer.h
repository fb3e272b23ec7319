// The 3-D view: patient, needle, probe and imaging plane of one frame in their room, drawn offscreen for one eye or
// both.
//
// A frame: upload nodes and uniforms; place every vertex (deform.comp); the lamp's shadow map; then one render pass
// over all eyes (multiview): drape, solids, room, imaging plane, glass organs, and the covers over them. The needle's
// vertices come last, right before all of it goes to the GPU. Of a glass organ only its nearest surface is seen: its
// depth is laid first, then its colour where the depth is its own. That needs no sorting of triangles and gives the
// same picture for any order of them.
#pragma once

#include "engine/content/scene.h"
#include "engine/gpu/commands.h"
#include "engine/render/camera.h"
#include "engine/render/geometry.h"
#include "engine/render/label_pass.h"
#include "engine/render/patient_extent.h"
#include "engine/render/room_layout.h"
#include "engine/render/shadow_pass.h"
#include "engine/render/surface_pipelines.h"
#include "engine/render/view_options.h"
#include "engine/state/biopsy_shot.h"
#include "engine/state/frame_state.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace stylet::render {

struct RenderSettings {
  int width = 1280;
  int height = 720;
  int views = 1;  ///< 2: stereo, left eye in layer 0, right eye in layer 1
  StereoSettings stereo{};
  bool antialias = true;         ///< 4 samples a pixel
  bool room = true;              ///< the operating room with its furniture and the drape; else a plain dark ground
  bool shadows = true;           ///< of the surgical lamp
  Detail detail{};               ///< of its surfaces
  double window_radius = 0.082;  ///< of the opening in skin, fat and muscle round the focus, m
};

/// What a renderer draws. Any thread.
Geometry geometry_of(const content::Scene& scene, const RenderSettings& settings);

/// Draws one scene. Thread: the one that uses the device.
class Renderer {
public:
  /// Uploads the scene's surfaces; keeps no reference to `scene`.
  /// @throws gpu::GpuError if the size is 0 or beyond the device, or views is not 1 or 2
  Renderer(gpu::Device& device, const content::Scene& scene, const RenderSettings& settings = {});
  /// The same with a geometry that was made before, in another thread.
  /// @param geometry  geometry_of() this scene; its detail counts
  Renderer(gpu::Device& device, const content::Scene& scene, const RenderSettings& settings, Geometry geometry);
  /// Waits for what uses the picture.
  ~Renderer() { device_.settle(); }
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Submits the frame; the image is complete for whoever uses it next on the device's queue (gpu::read_back, a pass
  /// that samples it). R8G8B8A8_SRGB, one layer an eye, valid until the next call.
  /// A body that `state` does not have is drawn at rest, a needle not at all.
  const gpu::Image& render(const state::FrameState& state, const content::Camera& camera,
                           const ViewOptions& options = {});
  /// The same for the eyes of a headset, one a view; RenderSettings::stereo does not matter then.
  /// @throws gpu::GpuError if there are not as many as views, or a field of view is empty or behind the eye
  const gpu::Image& render(const state::FrameState& state, std::span<const EyeView> eyes,
                           const ViewOptions& options = {});
  /// Pictures of another size from now on, of the same scene: what was uploaded stays. Waits for the device.
  /// @throws gpu::GpuError as the constructor
  void resize(int width, int height);
  /// The picture last rendered.
  const gpu::Image& image() const { return target_; }
  /// Labels and depths of the picture last rendered, of one eye; a pass of its own, which runs only here.
  ViewLabels read_labels(std::uint32_t layer = 0);
  const RenderSettings& settings() const { return settings_; }
  const RoomLayout& layout() const { return layout_; }
  /// Frames that drew the shadow map: one in which nothing has moved that throws a shadow keeps that of the frame
  /// before.
  std::uint64_t shadows_drawn() const { return shadows_drawn_; }
  /// Frames that were drawn: one that shows what the frame before showed (ViewOptions::pictures) keeps its picture.
  std::uint64_t frames_drawn() const { return frames_drawn_; }
  /// The eyes of the last frame, to project points as it does.
  const std::vector<Eye>& eyes() const { return eyes_; }
  /// Time the GPU spent on the stages of the last frame; waits for it. Empty: it was not drawn.
  std::vector<gpu::Timestamps::Span> stage_times() const;

private:
  const gpu::Image& render_seen(const state::FrameState& state, const content::Camera& camera,
                                const ViewOptions& options);
  void find_bodies(const state::FrameState& state);
  void take_nodes(gpu::Commands& commands);
  void take_zone(gpu::Commands& commands, const content::HeatedZone* zone);
  /// Each with the squared distance of its point that is nearest to the eye.
  std::vector<std::pair<float, const Piece*>> by_distance(std::span<const Piece> pieces) const;
  /// Opaque organs and the probe, nearest first: what lies behind is not shaded in vain.
  std::vector<const Piece*> solids_order() const;
  /// The glass organs and the zone, farthest first.
  std::vector<const Piece*> glass_order() const;
  /// What throws shadows, as the map has it.
  struct Casters {
    std::vector<Eigen::Vector3f> nodes{};  ///< of all bodies: the drape lies on them
    Eigen::Vector3f probe_position = Eigen::Vector3f::Zero();
    Eigen::Vector4f probe_orientation = Eigen::Vector4f::Zero();
    Eigen::Vector3f breath = Eigen::Vector3f::Zero();
    std::vector<Eigen::Vector3f> needle_positions{};
    std::vector<Eigen::Vector4f> needle_orientations{};
    float syringe = -1;  ///< held in it; negative: there is none
    bool drape = true;

    bool operator==(const Casters&) const = default;
    bool as_but_for_the_needle(const Casters& other) const;
  };
  /// All but the needle.
  Casters casters_of(const state::FrameState& state) const;
  void take_needle(Casters& casters) const;
  /// What a picture shows, beside what throws shadows.
  struct Shown {
    FrameUniforms frame{};  ///< camera, probe, breath, how far one sees
    std::vector<state::CoreTrack> cores{};
    std::optional<state::BiopsyShot> shot{};
    std::uint64_t zone = 0;
    const gpu::Image* plane = nullptr;
    const gpu::Image* screen = nullptr;
    const gpu::Image* panel = nullptr;
    std::uint64_t pictures = 0;  ///< ViewOptions::pictures
    std::array<std::optional<Eigen::Isometry3d>, 2> hands{};
    VkRect2D hidden{};

    bool same_as(const Shown& other) const;
  };
  /// Draws nothing. @return the picture of the frame before is that of this one, too
  bool still_shows(const Casters& casters, const std::optional<Shown>& shown) const;
  struct Pass;
  void make_framebuffers();
  void draw(gpu::Commands& commands, const ViewOptions& options) const;
  void draw(gpu::Commands& commands, const ViewOptions& options, const Pass& pass) const;
  const gpu::Image& colour() const { return multisampled_ ? *multisampled_ : target_; }

  gpu::Device& device_;
  RenderSettings settings_;
  RoomLayout layout_;
  std::optional<Eigen::Vector3d> focus_;  ///< what the covers' window shows: the first target; none: where one looks
  content::Probe probe_;
  PatientExtent patient_;
  Geometry geometry_;
  ZoneGeometry zone_;  ///< as the GPU has it
  std::uint64_t zone_version_ = 0;
  BodyNodes bodies_;  ///< of the state being drawn
  std::vector<Eye> eyes_;
  std::vector<Eigen::Vector3f> needle_positions_;  ///< as drawn
  std::vector<Eigen::Quaternionf> needle_orientations_;

  gpu::Buffer rest_;
  gpu::Buffer rest_nodes_;
  gpu::Buffer current_nodes_;
  gpu::Buffer drawn_;
  gpu::Buffer indices_;
  gpu::Buffer frame_;
  gpu::Image target_;
  std::optional<gpu::Image> multisampled_;
  gpu::Image depth_;
  gpu::Image black_;  ///< one pixel, bound where there is no picture
  gpu::Sampler sampler_;
  /// Over the same images, for some of the views.
  struct Pass {
    gpu::RenderPassHandle render_pass;
    gpu::FramebufferHandle framebuffer;
    SurfacePipelines pipelines;
  };
  std::vector<Pass> passes_;

  gpu::ComputePipeline deform_;
  ShadowPass shadow_;
  gpu::FrameRing ring_;
  gpu::Timestamps timestamps_;
  std::uint64_t submission_ = 0;
  std::optional<Casters> casters_;  ///< of the shadow map; none: it holds nothing yet
  std::uint64_t shadows_drawn_ = 0;
  std::optional<Shown> shown_;  ///< in the picture; none: that is not known
  std::uint64_t frames_drawn_ = 0;
  bool drawn_anew_ = false;           ///< the last frame
  bool with_needle_ = false;          ///< of the last frame
  bool with_syringe_ = false;         ///< the same
  bool with_shot_ = false;            ///< the same
  std::size_t cores_ = 0;             ///< the same
  bool with_panel_ = false;           ///< the same
  std::array<bool, 2> with_hands_{};  ///< the same: the controller of the needle, of the probe
  SeeThrough see_through_ = SeeThrough::window;
  std::optional<LabelPass> labels_;  ///< made when labels are asked for the first time
};

}  // namespace stylet::render
