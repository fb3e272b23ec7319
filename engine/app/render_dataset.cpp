// Random ultrasound frames with labels, for people who train networks: any number, on any number of machines.
#include "engine/app/render.h"

#include "engine/app/build_name.h"
#include "engine/files/dataset_folder.h"
#include "engine/files/error.h"
#include "engine/gpu/device.h"
#include "engine/picture/png_bytes.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/random_frame.h"
#include "engine/session/replay.h"
#include "engine/session/session_report.h"
#include "engine/stills/label_preview.h"
#include "engine/tracking/tracked_transforms.h"
#include "engine/ultrasound/imager.h"
#include "engine/ultrasound/presets.h"

#include <fmt/format.h>

#include <array>
#include <optional>

namespace stylet::app {

namespace {

using Json = nlohmann::ordered_json;

Json ranges_json(const session::RandomRanges& r) {
  return {{"from_s", r.from_s},
          {"to_s", r.to_s},
          {"slide_mm", r.slide_mm},
          {"slide_across_mm", r.slide_across_mm},
          {"press_mm", r.press_mm},
          {"tilt_deg", r.tilt_deg},
          {"rock_deg", r.rock_deg},
          {"twist_deg", r.twist_deg},
          {"needle_shift_mm", r.needle_shift_mm},
          {"needle_tilt_deg", r.needle_tilt_deg},
          {"attenuation_share", r.attenuation_share},
          {"backscatter_db", r.backscatter_db},
          {"impedance_share", r.impedance_share},
          {"texture_share", r.texture_share}};
}

Json numbers(const Eigen::Vector3f& v) {
  return {v.x(), v.y(), v.z()};
}

Json about(std::uint64_t index, const content::Scene& scene, const session::RandomFrame& frame,
           const session::SettledFrame& settled, const ultrasound::SectorGeometry& geometry,
           const gpu::DeviceIdentity& gpu) {
  Json json{{"format", "stylet-dataset-frame"},
            {"version", 1},
            {"index", index},
            {"speckle_seed", frame.seed},
            {"motion_s", frame.motion_s},
            {"inspiration", scene.breathing.amplitude * frame.inspiration}};
  const state::FrameState& state = settled.state;
  json["speed_m_per_s"] = settled.speed;
  for (const tracking::NamedTransform& transform : tracking::tracked_transforms(state, geometry)) {
    Json& rows = json["transforms"][transform.name];
    for (int i = 0; i < 16; ++i) rows.push_back(transform.matrix(i / 4, i % 4));
  }
  for (const Eigen::Vector3f& node : state.needle_positions) json["needle"]["nodes_m"].push_back(numbers(node));
  json["needle"]["insertion_depth_m"] = state.insertion_depth;
  if (const auto* target = state.nearest_target()) json["needle"]["target_distance_m"] = target->distance;
  json["needle"]["force_n"] = numbers(state.force);
  json["probe"] = {{"force_n", state.probe_force}, {"area_m2", state.probe_area}};
  for (std::size_t i = 1; i < scene.tissues.size(); ++i) {
    const content::Acoustics& a = scene.tissues[i].acoustics;
    json["tissues"][scene.tissues[i].name] = {{"impedance_rayl", a.impedance_rayl},
                                              {"attenuation_db_per_cm_mhz", a.attenuation_db_per_cm_mhz},
                                              {"backscatter_db", a.backscatter_db},
                                              {"texture_db", a.texture_db}};
  }
  json["gpu"] = gpu.name;
  json["gpu_driver"] = gpu.driver;
  return json;
}

std::vector<files::FrameFile> draw(ultrasound::Imager& imager, const state::FrameState& state, bool preview) {
  imager.image(state);
  const ultrasound::SectorGeometry& size = imager.geometry();
  const std::vector<std::uint8_t> grey = imager.read_back();
  const std::vector<std::uint8_t> labels = imager.read_label_map();
  std::vector<files::FrameFile> files{{"image", picture::png_bytes(size.width, size.height, grey)},
                                      {"labels", picture::png_bytes(size.width, size.height, labels)}};
  if (preview) {
    files.push_back({"preview", picture::png_bytes(stills::label_preview(
                                    stills::grey_picture(size.width, size.height, grey), labels))});
  }
  return files;
}

}  // namespace

DatasetFrames render_dataset(const DatasetSettings& settings, Observer& observer) {
  const RenderSettings& common = settings.common;
  const PictureSize size = common.ultrasound_size;
  const Shard shard = settings.shard;
  if (settings.only && (*settings.only >= settings.frames || *settings.only % shard.of != shard.index)) {
    throw files::ContentError(fmt::format("--only {}: is none of the {} frames asked for; give one from 0 to {}{}",
                                          *settings.only, settings.frames, settings.frames - 1,
                                          shard.of > 1 ? " of this shard" : ""));
  }
  content::Scene scene = load_scene(common.scenario, observer);
  set_scanner(scene, common.scanner);
  const physics::Coupling coupling = chosen_coupling(common.coupling, scene);
  session::RandomRanges ranges = settings.ranges;
  const double end_s = scene.motion.stylus.empty() ? 0 : scene.motion.stylus.back().time_s;
  ranges.from_s = common.from_s;
  ranges.to_s = common.to_s.value_or(end_s);
  if (!(ranges.from_s >= 0 && ranges.from_s <= ranges.to_s && ranges.to_s <= end_s)) {
    throw files::ContentError(fmt::format("--from {} --to {}: the range must lie within the motion, 0 to {} s",
                                          ranges.from_s, ranges.to_s, end_s));
  }
  const content::PictureLabels legend(scene);
  gpu::Device gpu({.gpu = common.gpu});
  content::Scene randomized = scene;
  ultrasound::ImagerSettings look = ultrasound::still_settings(scene.probe);
  look.width = size.width;
  look.height = size.height;
  look.depth_scale = false;
  const double mm_per_pixel =
      ultrasound::SectorGeometry::fit(ultrasound::ScanGeometry::of(scene.probe, look.line_oversampling), size.width,
                                      size.height)
          .mm_per_pixel();
  const files::DatasetFolder folder(common.out,
                                    {{"format", "stylet-dataset"},
                                     {"version", 1},
                                     {"build", build_name()},
                                     {"scenario", scene.name},
                                     {"scenario_hash", session::hash_text(session::file_hash(scene.scenario))},
                                     {"coupling", session::coupling_name(coupling)},
                                     {"seed", common.seed},
                                     {"scanner", scanner_json(scene.probe)},
                                     {"frames", settings.frames},
                                     {"previews", common.previews},
                                     {"width", size.width},
                                     {"height", size.height},
                                     {"mm_per_pixel", mm_per_pixel},
                                     {"ranges", ranges_json(ranges)},
                                     {"labels", legend_json(legend)}});
  std::optional<ultrasound::Imager> imager;  // one for all frames: it holds nothing of the one before
  DatasetFrames frames;
  try {
    for (std::uint64_t index = shard.index; index < settings.frames; index += shard.of) {
      if (settings.only && index != *settings.only) continue;
      const auto show = [&](double share) {
        show_progress(observer, "Drawing frames",
                      (static_cast<double>(index) + share * static_cast<double>(shard.of)) /
                          static_cast<double>(settings.frames));
      };
      show(0);
      if (folder.whole(index)) {
        ++frames.kept;
        continue;
      }
      const session::RandomFrame frame = session::draw_random_frame(scene, ranges, common.seed, index);
      session::apply_frame(randomized, frame);
      const session::SettledFrame settled = session::settle(randomized, coupling, frame, show);
      if (!imager) imager.emplace(gpu, randomized, look);
      imager->set_acoustics(randomized.tissues);
      imager->set_seed(frame.seed);
      const bool preview = common.previews > 0 && index % static_cast<std::uint64_t>(common.previews) == 0;
      const std::vector<files::FrameFile> files = draw(*imager, settled.state, preview);
      Json made_of = about(index, randomized, frame, settled, imager->geometry(), gpu.identity());
      if (const std::string black = imager->diagnosis(); !black.empty()) made_of["black"] = black;
      folder.put(index, files, std::move(made_of));
      ++frames.drawn;
    }
  } catch (const Stopped&) {
    throw Stopped(
        fmt::format("interrupted; {} of {} frames are whole and stay in {}; give the same command again for the rest",
                    folder.count(settings.frames), settings.frames, common.out.string()));
  }
  observer.task_done();
  frames.there = folder.count(settings.frames);
  return frames;
}

}  // namespace stylet::app
