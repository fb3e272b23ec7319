// `stylet render`: deterministic frames of a scenario for data sets, tests and papers.
#include "engine/content/error.h"
#include "engine/content/scenario.h"
#include "engine/gpu/device.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/frame_clock.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/lockstep.h"
#include "engine/session/output_directory.h"
#include "engine/session/pictures.h"
#include "engine/session/session_report.h"
#include "engine/session/state_hash.h"
#include "engine/session/step_hash.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace stylet::tools {

namespace {

struct RenderOptions {
  std::string scenario;
  std::string out;
  std::string size = "1280x720";
  std::string ultrasound_size = "640x480";
  double frames_per_second = 10;
  double from_s = 0;
  std::optional<double> to_s;
  std::vector<double> camera;
  bool stereo = false;
  std::uint32_t seed = 1;
  std::string device;
  std::string coupling;
  std::string gpu;
};

struct Size {
  int width;
  int height;
};
Size parse_size(const std::string& option, const std::string& text) {
  Size size{};
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) != 2 || size.width < 64 ||
      size.height < 64 || size.width > 8192 || size.height > 8192) {
    throw content::ContentError(
        fmt::format("{} {}: give WIDTHxHEIGHT in pixels, each from 64 to 8192, such as 1280x720", option, text));
  }
  return size;
}

content::Camera chosen_camera(const RenderOptions& options, const content::Scene& scene) {
  if (options.camera.empty()) return scene.camera;
  const std::vector<double>& c = options.camera;
  if (!std::ranges::all_of(c, [](double v) { return std::isfinite(v); })) {
    throw content::ContentError("--camera: every number must be finite");
  }
  content::Camera camera = scene.camera;
  camera.eye = {c[0], c[1], c[2]};
  camera.look_at = {c[3], c[4], c[5]};
  if ((camera.eye - camera.look_at).norm() < 1e-3) {
    throw content::ContentError("--camera: the eye and the point it looks at are the same; move one of them");
  }
  return camera;
}

std::string picture_hash(const view::Picture& image) {
  session::StateHash hash;
  hash.add(static_cast<std::uint64_t>(image.width));
  for (const std::uint8_t byte : image.rgba) hash.add(std::uint64_t{byte});
  return session::hash_text(hash.value());
}

/// The pictures that a manifest of an earlier run lists; none where there is no such manifest.
std::vector<std::string> listed_files(const std::filesystem::path& manifest) {
  std::vector<std::string> files;
  std::ifstream in(manifest);
  const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || json.value("format", nlohmann::json()) != "stylet-frames") return files;
  for (const nlohmann::json& frame : json.value("frames", nlohmann::json::array())) {
    for (const char* key : {"view", "ultrasound"}) {
      if (frame.is_object() && frame.contains(key) && frame[key].is_string()) files.push_back(frame[key]);
    }
  }
  return files;
}

int render(const RenderOptions& options) {
  const Size view_size = parse_size("--size", options.size);
  const Size ultrasound_size = parse_size("--ultrasound-size", options.ultrasound_size);
  Progress progress;
  const content::Scene scene = load_scene(options.scenario, progress);
  const physics::Coupling coupling = chosen_coupling(options.coupling, scene);
  const content::Camera camera = chosen_camera(options, scene);
  const Stylus stylus = make_stylus(options.device, scene);
  if (!std::isfinite(stylus.duration_s)) {
    throw content::ContentError("--device mouse: frames need a motion that repeats; use recorded:FILE or scripted");
  }
  const double to_s = options.to_s.value_or(stylus.duration_s);
  if (!(options.frames_per_second > 0 && options.frames_per_second <= 1000)) {
    throw content::ContentError("--fps: give a number of frames a second above 0 and up to 1000");
  }
  if (!(options.from_s >= 0 && options.from_s <= to_s && to_s <= stylus.duration_s)) {
    throw content::ContentError(fmt::format("--from {} --to {}: the range must lie within the motion, 0 to {} s",
                                            options.from_s, to_s, stylus.duration_s));
  }
  gpu::Device gpu({.gpu = options.gpu});
  session::OutputDirectory out(options.out);
  out.supersede(listed_files(out.destination() / "manifest.json"));
  session::Pictures pictures(gpu, scene,
                             {.view_width = view_size.width,
                              .view_height = view_size.height,
                              .ultrasound_width = ultrasound_size.width,
                              .ultrasound_height = ultrasound_size.height,
                              .stereo = options.stereo,
                              .seed = options.seed});
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  session::StepHash hash;
  session::FramePublisher publisher(scene);
  session::FrameClock clock(publisher,
                            {.frames_per_second = options.frames_per_second, .from_s = options.from_s, .to_s = to_s},
                            [&](int frame, const state::FrameState& state) {
                              const std::string view_name = fmt::format("view_{:05}.png", frame);
                              const std::string ultrasound_name = fmt::format("ultrasound_{:05}.png", frame);
                              const auto [view, ultrasound] = pictures.draw(state, camera);
                              view::write_png(out.staged(view_name), view);
                              view::write_png(out.staged(ultrasound_name), ultrasound);
                              frames.push_back({{"time_s", state.time_s},
                                                {"view", view_name},
                                                {"view_hash", picture_hash(view)},
                                                {"ultrasound", ultrasound_name},
                                                {"ultrasound_hash", picture_hash(ultrasound)},
                                                {"force_n", {state.force.x(), state.force.y(), state.force.z()}},
                                                {"insertion_depth_m", state.insertion_depth},
                                                {"target_distance_m", state.target_distance},
                                                {"probe_force_n", state.probe_force},
                                                {"probe_area_m2", state.probe_area}});
                            });
  const haptic::StylusSample first = stylus.device->read(0);
  session::CoupledLoops loops(scene, coupling, {first.position, first.orientation}, {&hash, &publisher, &clock});
  // A little longer than asked for: the last frame lies between two simulation steps.
  const double duration_s = to_s + 2.0 / scene.rates.simulation_hz;
  session::run_lockstep(loops, *stylus.device, scene, duration_s, [&](double share) {
    throw_if_interrupted();
    progress.show("Drawing frames", share);
  });
  progress.done();
  session::write_json(out.staged("manifest.json"), {{"format", "stylet-frames"},
                                                    {"version", 1},
                                                    {"build", build_name()},
                                                    {"scenario", scene.scenario.string()},
                                                    {"coupling", session::coupling_name(coupling)},
                                                    {"seed", options.seed},
                                                    {"frames_per_second", options.frames_per_second},
                                                    {"state_hash", session::hash_text(hash.state())},
                                                    {"gpu", gpu.identity().name},
                                                    {"gpu_driver", gpu.identity().driver},
                                                    {"frames", frames}});
  out.commit("manifest.json");
  fmt::print("{}: {} frames of {} and {}, manifest.json\n", out.destination().string(), clock.frames(), options.size,
             options.ultrasound_size);
  return kExitYes;
}

}  // namespace

void add_render(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("render", "Draw deterministic PNG frames of a scenario; needs no display");
  auto options = std::make_shared<RenderOptions>();
  command->add_option("SCENARIO", options->scenario, "Name of a scenario in content/scenarios, or a file")
      ->required();
  command->add_option("--out", options->out, "Folder for frames and manifest.json")->required();
  command->add_option("--size", options->size, "Of the 3-D view, pixels")->capture_default_str();
  command->add_option("--ultrasound-size", options->ultrasound_size, "Of the ultrasound image, pixels")
      ->capture_default_str();
  command->add_option("--fps", options->frames_per_second, "Frames a second of session time")->capture_default_str();
  command->add_option("--from", options->from_s, "First frame, s")->capture_default_str();
  command->add_option("--to", options->to_s, "Last frame, s; default: the end of the motion");
  command->add_option("--camera", options->camera, "Eye and point looked at, patient frame, m: x y z x y z")
      ->expected(6);
  command->add_flag("--stereo", options->stereo, "Both eyes side by side");
  command->add_option("--seed", options->seed, "Of speckle and noise")->capture_default_str();
  command->add_option("--device", options->device, kDeviceHelp);
  command->add_option("--coupling", options->coupling, kCouplingHelp);
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  command->footer(
      "The loops run in lockstep, so the same binary gives the same frames, whatever else the machine does. On "
      "Mesa's\n"
      "lavapipe the pictures are the same bits too; manifest.json holds their hashes, the device and the driver.\n\n"
      "  stylet render liver_biopsy --out frames --fps 2 --size 640x480\n"
      "  stylet render liver_biopsy --out frames --from 5 --to 6 --camera 0.3 0.5 0.4 -0.05 0.35 0.03");
  command->callback([options, &exit_code] { exit_code = render(*options); });
}

}  // namespace stylet::tools
