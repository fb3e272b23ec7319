// Frames of a scenario's motion: the 3-D view and the ultrasound image, or the image alone as a tracked sequence.
#include "engine/app/render.h"

#include "engine/app/build_name.h"
#include "engine/app/stylus.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"
#include "engine/gpu/device.h"
#include "engine/picture/png_bytes.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/frame_clock.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/lockstep.h"
#include "engine/session/session_report.h"
#include "engine/session/state_hash.h"
#include "engine/session/step_hash.h"
#include "engine/stills/label_preview.h"
#include "engine/stills/pictures.h"
#include "engine/tracking/sequence_file.h"
#include "engine/tracking/tracked_transforms.h"
#include "engine/training/training_session.h"
#include "engine/ultrasound/imager.h"
#include "engine/ultrasound/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace stylet::app {

namespace {

content::Camera chosen_camera(const std::vector<double>& c, const content::Scene& scene) {
  if (c.empty()) return scene.camera;
  if (!std::ranges::all_of(c, [](double v) { return std::isfinite(v); })) {
    throw files::ContentError("--camera: every number must be finite");
  }
  content::Camera camera = scene.camera;
  camera.eye = {c[0], c[1], c[2]};
  camera.look_at = {c[3], c[4], c[5]};
  if ((camera.eye - camera.look_at).norm() < 1e-3) {
    throw files::ContentError("--camera: the eye and the point it looks at are the same; move one of them");
  }
  return camera;
}

/// Of the pixels: for a manifest.
std::string pixel_hash(int width, std::span<const std::uint8_t> bytes) {
  session::StateHash hash;
  hash.add(static_cast<std::uint64_t>(width));
  for (const std::uint8_t byte : bytes) hash.add(std::uint64_t{byte});
  return session::hash_text(hash.value());
}

/// The pictures that a manifest of an earlier run lists; none where there is no such manifest.
std::vector<std::string> listed_files(const std::filesystem::path& manifest) {
  std::vector<std::string> files;
  std::ifstream in(manifest);
  const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || json.value("format", nlohmann::json()) != "stylet-frames") return files;
  if (json.contains("sequence") && json["sequence"].is_string()) files.push_back(json["sequence"]);
  for (const nlohmann::json& frame : json.value("frames", nlohmann::json::array())) {
    for (const char* key : {"view", "ultrasound", "ultrasound_labels", "ultrasound_preview", "view_labels",
                            "view_depth", "view_preview"}) {
      if (frame.is_object() && frame.contains(key) && frame[key].is_string()) files.push_back(frame[key]);
    }
  }
  return files;
}

constexpr double kDepthMm = 0.1;  // render::kDepthUnit
static_assert(render::kDepthUnit == 1e-4F);
constexpr const char* kSequence = "ultrasound.igs.mha";

/// Draws frames into the staged folder and lists them.
class FrameDrawer {
public:
  FrameDrawer(const MotionFramesSettings& settings, gpu::Device& gpu, const content::Scene& scene,
              const files::OutputDirectory& out)
      : settings_(settings), out_(out), camera_(chosen_camera(settings.camera, scene)), legend_(scene) {
    const PictureSize size = settings.common.ultrasound_size;
    if (settings.ultrasound) {
      ultrasound::ImagerSettings look = ultrasound::still_settings(scene.probe);
      look.width = size.width;
      look.height = size.height;
      look.seed = settings.common.seed;
      imager_ = std::make_unique<ultrasound::Imager>(gpu, scene, look);
      out.named_in_place([&] {
        sequence_ = std::make_unique<tracking::SequenceFile>(out.staged(kSequence), size.width, size.height);
      });
      return;
    }
    const PictureSize view = settings.view_size;
    pictures_ = std::make_unique<stills::Pictures>(gpu, scene,
                                                   stills::PictureSettings{.view_width = view.width,
                                                                           .view_height = view.height,
                                                                           .ultrasound_width = size.width,
                                                                           .ultrasound_height = size.height,
                                                                           .stereo = settings.stereo,
                                                                           .seed = settings.common.seed,
                                                                           .room = settings.room,
                                                                           .notes = !settings.labels});
  }

  void draw(int frame, const state::FrameState& state) {
    nlohmann::ordered_json entry{{"time_s", state.time_s}};
    if (pictures_) {
      draw_both(frame, state, entry);
    } else {
      draw_ultrasound(frame, state, entry);
    }
    if (const std::string note = pictures_ ? pictures_->note() : imager_->diagnosis(); !note.empty()) {
      entry["note"] = note;
    }
    entry["force_n"] = {state.force.x(), state.force.y(), state.force.z()};
    entry["insertion_depth_m"] = state.insertion_depth;
    if (const auto* target = state.nearest_target()) entry["target_distance_m"] = target->distance;
    entry["probe_force_n"] = state.probe_force;
    entry["probe_area_m2"] = state.probe_area;
    frames_.push_back(std::move(entry));
  }

  /// What the frames have in common, and the frames.
  void finish(nlohmann::ordered_json& manifest) {
    if (settings_.labels) manifest["labels"] = legend_json(legend_);
    if (settings_.labels && pictures_) manifest["view_depth_mm_per_unit"] = kDepthMm;
    if (sequence_) {
      sequence_->close();
      manifest["sequence"] = kSequence;
      manifest["ultrasound_mm_per_pixel"] = imager_->geometry().mm_per_pixel();
    }
    manifest["frames"] = std::move(frames_);
  }

private:
  bool has_preview(int frame) const {
    return settings_.labels && settings_.common.previews > 0 && frame % settings_.common.previews == 0;
  }

  void draw_both(int frame, const state::FrameState& state, nlohmann::ordered_json& entry) {
    const auto [view, ultrasound] = pictures_->draw(state, camera_);
    const std::string view_name = fmt::format("view_{:05}.png", frame);
    const std::string ultrasound_name = fmt::format("ultrasound_{:05}.png", frame);
    picture::write_png(out_.staged(view_name), view);
    picture::write_png(out_.staged(ultrasound_name), ultrasound);
    entry["view"] = view_name;
    entry["view_hash"] = pixel_hash(view.width, view.rgba);
    entry["ultrasound"] = ultrasound_name;
    entry["ultrasound_hash"] = pixel_hash(ultrasound.width, ultrasound.rgba);
    if (!settings_.labels) return;
    const render::ViewLabels seen = pictures_->view_labels();
    draw_labels("view", frame, seen.labels, view, entry);
    const std::string depth_name = fmt::format("view_depth_{:05}.png", frame);
    out_.write(depth_name, picture::png_bytes(view.width, view.height, seen.depth));
    entry["view_depth"] = depth_name;
    draw_labels("ultrasound", frame, pictures_->ultrasound_labels(), ultrasound, entry);
  }

  void draw_ultrasound(int frame, const state::FrameState& state, nlohmann::ordered_json& entry) {
    imager_->image(state);
    const std::vector<std::uint8_t> grey = imager_->read_back();
    const ultrasound::SectorGeometry& geometry = imager_->geometry();
    const std::string name = fmt::format("ultrasound_{:05}.png", frame);
    out_.write(name, picture::png_bytes(geometry.width, geometry.height, grey));
    sequence_->add(
        {.time_s = state.time_s, .pixels = grey, .transforms = tracking::tracked_transforms(state, geometry)});
    entry["ultrasound"] = name;
    entry["ultrasound_hash"] = pixel_hash(geometry.width, grey);
    if (settings_.labels) {
      draw_labels("ultrasound", frame, imager_->read_label_map(),
                  stills::grey_picture(geometry.width, geometry.height, grey), entry);
    }
  }

  /// @param of  "view" or "ultrasound"
  void draw_labels(const std::string& of, int frame, const std::vector<std::uint8_t>& labels,
                   const picture::Picture& picture, nlohmann::ordered_json& entry) {
    const std::string name = fmt::format("{}_labels_{:05}.png", of, frame);
    out_.write(name, picture::png_bytes(picture.width, picture.height, labels));
    entry[of + "_labels"] = name;
    if (!has_preview(frame)) return;
    const std::string preview = fmt::format("{}_preview_{:05}.png", of, frame);
    out_.write(preview, picture::png_bytes(stills::label_preview(picture, labels)));
    entry[of + "_preview"] = preview;
  }

  const MotionFramesSettings& settings_;
  const files::OutputDirectory& out_;
  content::Camera camera_;
  content::PictureLabels legend_;
  std::unique_ptr<stills::Pictures> pictures_;  // of both
  std::unique_ptr<ultrasound::Imager> imager_;  // of the ultrasound image alone
  std::unique_ptr<tracking::SequenceFile> sequence_;
  nlohmann::ordered_json frames_ = nlohmann::ordered_json::array();
};

/// Takes the course along with the steps, as whoever shows a session does.
class CourseListener final : public session::StepListener {
public:
  explicit CourseListener(training::TrainingSession& course) : course_(course) {}
  void simulation_stepped(const recording::SimulationStepRecord&, const physics::SimulationReport&,
                          const physics::TissueState&, const physics::NeedleState&) override {
    course_.step();
  }

private:
  training::TrainingSession& course_;
};

}  // namespace

MotionFrames render_motion(const MotionFramesSettings& settings, Observer& observer) {
  const RenderSettings& common = settings.common;
  if (const StylusKind& stylus = find_stylus(settings.stylus); stylus.held) {
    throw files::ContentError(fmt::format(
        "--device {}: frames need a motion that repeats; use recorded, recorded:FILE or scripted", settings.stylus));
  }
  content::Scene scene = load_scene(common.scenario, observer);
  set_scanner(scene, common.scanner);
  const physics::Coupling coupling = chosen_coupling(common.coupling, scene);
  chosen_camera(settings.camera, scene);
  const Stylus stylus = open_stylus(settings.stylus, scene);
  const double to_s = common.to_s.value_or(stylus.duration_s);
  if (!(settings.frames_per_second > 0 && settings.frames_per_second <= 1000)) {
    throw files::ContentError("--fps: give a number of frames a second above 0 and up to 1000");
  }
  if (!(common.from_s >= 0 && common.from_s <= to_s && to_s <= stylus.duration_s)) {
    throw files::ContentError(fmt::format("--from {} --to {}: the range must lie within the motion, 0 to {} s",
                                          common.from_s, to_s, stylus.duration_s));
  }
  gpu::Device gpu({.gpu = common.gpu});
  files::OutputDirectory out(common.out);
  out.supersede(listed_files(out.destination() / "manifest.json"));
  FrameDrawer drawer(settings, gpu, scene, out);
  session::StepHash hash;
  session::FramePublisher publisher(scene);
  training::TrainingSession course(scene, {.automatic = true});
  CourseListener course_listener(course);
  session::FrameClock clock(publisher,
                            {.frames_per_second = settings.frames_per_second, .from_s = common.from_s, .to_s = to_s},
                            [&](int frame, const state::FrameState& state) {
                              state::FrameState shown = state;
                              course.shown().show_at(state.time_s, shown);
                              out.named_in_place([&] { drawer.draw(frame, shown); });
                            });
  const haptic::StylusSample first = stylus.device->read(0);
  session::CoupledLoops loops(scene, coupling, {first.position, first.orientation},
                              {&hash, &publisher, &course.watch(), &course_listener, &clock});
  // A little longer than asked for: the last frame lies between two simulation steps.
  const double duration_s = to_s + 2.0 / scene.rates.simulation_hz;
  session::run_lockstep(loops, *stylus.device, scene, duration_s,
                        [&](double share) { show_progress(observer, "Drawing frames", share); });
  observer.task_done();
  nlohmann::ordered_json manifest{{"format", "stylet-frames"},
                                  {"version", 1},
                                  {"build", build_name()},
                                  {"scenario", scene.scenario.string()},
                                  {"coupling", session::coupling_name(coupling)},
                                  {"seed", common.seed},
                                  {"scanner", scanner_json(scene.probe)},
                                  {"frames_per_second", settings.frames_per_second},
                                  {"state_hash", session::hash_text(hash.state())},
                                  {"gpu", gpu.identity().name},
                                  {"gpu_driver", gpu.identity().driver}};
  out.named_in_place([&] {
    drawer.finish(manifest);
    session::write_json(out.staged("manifest.json"), manifest);
  });
  out.commit("manifest.json");
  return {.folder = out.destination(), .frames = clock.frames()};
}

}  // namespace stylet::app
