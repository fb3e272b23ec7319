// `stylet render`: deterministic frames of a scenario for data sets, tests and papers.
#include "engine/app/render.h"

#include "engine/files/error.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

namespace stylet::tools {

namespace {

/// Of "WIDTHxHEIGHT". @throws files::ContentError  in the name of the option
app::PictureSize parse_size(const std::string& option, const std::string& text) {
  app::PictureSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) != 2 || size.width < 64 ||
      size.height < 64 || size.width > 8192 || size.height > 8192) {
    throw files::ContentError(
        fmt::format("{} {}: give WIDTHxHEIGHT in pixels, each from 64 to 8192, such as 1280x720", option, text));
  }
  return size;
}

app::Shard parse_shard(const std::string& text) {
  if (text.empty()) return {};
  unsigned index = 0;
  unsigned of = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%u/%u%c", &index, &of, &rest) != 2 || of == 0 || index >= of) {
    throw files::ContentError(fmt::format("--shard {}: give I/N with I from 0 to N - 1, such as 0/8", text));
  }
  return {index, of};
}

struct RenderOptions {
  app::MotionFramesSettings motion{};
  app::DatasetSettings dataset{};  ///< but what both have in common
  std::string size = "1280x720";
  std::string ultrasound_size = "640x480";
  std::string shard{};  ///< "I/N"; empty: all frames
};

int render_motion(const RenderOptions& options) {
  app::MotionFramesSettings settings = options.motion;
  settings.view_size = parse_size("--size", options.size);
  settings.common.ultrasound_size = parse_size("--ultrasound-size", options.ultrasound_size);
  Terminal terminal;
  const app::MotionFrames done = app::render_motion(settings, terminal);
  const std::string what = settings.ultrasound ? options.ultrasound_size + ", ultrasound.igs.mha"
                                               : options.size + " and " + options.ultrasound_size;
  fmt::print("{}: {} frames of {}, manifest.json\n", done.folder.string(), done.frames, what);
  return kExitYes;
}

int render_dataset(const RenderOptions& options) {
  app::DatasetSettings settings = options.dataset;
  settings.common = options.motion.common;
  settings.common.ultrasound_size = parse_size("--ultrasound-size", options.ultrasound_size);
  settings.shard = parse_shard(options.shard);
  if (!options.motion.ultrasound) {
    throw files::ContentError(
        "--random: goes with --ultrasound; of the 3-D view there are frames of the motion only");
  }
  Terminal terminal;
  const app::DatasetFrames done = app::render_dataset(settings, terminal);
  fmt::print("{}: {} frames drawn, {} were there; {} of {} in all\n", settings.common.out.string(), done.drawn,
             done.kept, done.there, settings.frames);
  return kExitYes;
}

constexpr const char* kRenderFooter =
    "The loops run in lockstep, so the same binary gives the same frames, whatever else the machine does. On Mesa's\n"
    "lavapipe the pictures are the same bits too; manifest.json holds their hashes, the device and the driver.\n\n"
    "  stylet render liver_biopsy --out frames --fps 2 --size 640x480\n"
    "  stylet render liver_biopsy --out frames --from 5 --to 6 --camera 0.3 0.5 0.4 -0.05 0.35 0.03\n"
    "  stylet render liver_biopsy --out frames --fps 2 --labels           label and depth maps beside the pictures\n"
    "  stylet render liver_biopsy --out scan --ultrasound --fps 20        opens in 3D Slicer: "
    "scan/ultrasound.igs.mha\n\n"
    "Data sets: --random N draws N ultrasound images with label maps instead of those of the motion. Frame i is "
    "made\n"
    "from the seed and i alone, so frames can be made in any order, on any number of machines, and again:\n"
    "  probe    from where the scenario has it: slid over the skin, pressed, tilted, rocked and twisted\n"
    "  breath   held at a random phase\n"
    "  needle   on the scenario's own way, shifted and tilted, up to a random moment of the motion (--from, --to)\n"
    "  tissue   acoustic values of each, within the ranges below; speckle and noise of its own\n"
    "The physics of each frame starts at rest with its own probe and breath, drives the needle in and lets "
    "everything\n"
    "come to rest: no frame inherits the state of another. Frames that are there whole are kept, torn ones are made\n"
    "again: after Ctrl-C or a crash give the same command again.\n\n"
    "  stylet render liver_biopsy --ultrasound --random 1000 --seed 1 --out set\n"
    "  stylet render liver_biopsy --ultrasound --random 1000 --seed 1 --out set --shard 3/16    one of 16 machines\n"
    "  stylet render liver_biopsy --ultrasound --random 1000 --seed 1 --out one --only 123      that frame alone\n"
    "  stylet render liver_biopsy --ultrasound --random 1000 --from 7 --out in                  with the needle "
    "inside\n"
    "tools/jobs has job files for Slurm and Kubernetes.";

/// The options of data sets; none of them does anything without --random.
void add_random(CLI::App& command, const std::shared_ptr<RenderOptions>& options) {
  const char* group = "Data sets (with --ultrasound)";
  CLI::Option* random =
      command.add_option("--random", options->dataset.frames, "So many random frames instead of those of the motion")
          ->check(CLI::Range(1, 100'000'000))
          ->group(group);
  const CLI::Validator finite(
      [](const std::string& text) {
        return std::string(text.find_first_of("nN") == text.npos ? "" : "is not a number");
      },
      "");
  const auto number = [&](const char* name, double& value, double most, const char* help) {
    command.add_option(name, value, help)
        ->check(finite)
        ->check(CLI::Range(0.0, most))
        ->needs(random)
        ->capture_default_str()
        ->group(group);
  };
  command.add_option("--shard", options->shard, "I/N: only frames I, I + N, I + 2 N ...; I from 0")
      ->needs(random)
      ->group(group);
  command.add_option("--only", options->dataset.only, "Only this frame")->needs(random)->group(group);
  session::RandomRanges& r = options->dataset.ranges;
  number("--slide", r.slide_mm, 200, "Probe on the skin along the image, +- mm");
  number("--slide-across", r.slide_across_mm, 200, "Probe on the skin across the image, +- mm");
  number("--press", r.press_mm, 20, "Probe into the skin, +- mm");
  number("--tilt", r.tilt_deg, 90, "Image plane out of itself, +- degrees");
  number("--rock", r.rock_deg, 90, "Image in its plane, +- degrees");
  number("--twist", r.twist_deg, 180, "Probe about its axis, +- degrees");
  number("--needle-shift", r.needle_shift_mm, 200, "Way of the needle, across it, +- mm");
  number("--needle-tilt", r.needle_tilt_deg, 90, "Way of the needle about where it enters, +- degrees");
  number("--attenuation", r.attenuation_share, 0.9, "Of each tissue, +- share");
  number("--backscatter", r.backscatter_db, 40, "Of each tissue, +- dB");
  number("--impedance", r.impedance_share, 0.5, "Of each tissue, +- share");
  number("--texture", r.texture_share, 1, "Of each tissue, +- share");
}

}  // namespace

void add_render(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("render", "Draw deterministic PNG frames of a scenario; needs no display");
  auto options = std::make_shared<RenderOptions>();
  command
      ->add_option("SCENARIO", options->motion.common.scenario, "Name of a scenario in content/scenarios, or a file")
      ->required();
  command->add_option("--out", options->motion.common.out, "Folder for frames and manifest.json")->required();
  command->add_option("--size", options->size, "Of the 3-D view, pixels")->capture_default_str();
  command->add_option("--ultrasound-size", options->ultrasound_size, "Of the ultrasound image, pixels")
      ->capture_default_str();
  command->add_option("--fps", options->motion.frames_per_second, "Frames a second of session time")
      ->capture_default_str();
  command->add_option("--from", options->motion.common.from_s, "First frame, s")->capture_default_str();
  command->add_option("--to", options->motion.common.to_s, "Last frame, s; default: the end of the motion");
  command->add_option("--camera", options->motion.camera, "Eye and point looked at, patient frame, m: x y z x y z")
      ->expected(6);
  command->add_flag(
      "--ultrasound", options->motion.ultrasound,
      "The ultrasound image alone: grey PNG files and ultrasound.igs.mha, which 3D Slicer and PLUS open");
  command->add_flag(
      "--labels", options->motion.labels,
      "With every picture a label map of the same size: which tissue a pixel shows; legend in the manifest");
  command
      ->add_option("--previews", options->motion.common.previews,
                   "Every so manyth label map also in colour over its picture")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--stereo", options->motion.stereo, "Both eyes side by side");
  command->add_flag("--room", options->motion.room,
                    "The 3-D view shows the operating room and the drape, not the patient alone");
  command->add_option("--seed", options->motion.common.seed, "Of speckle and noise")->capture_default_str();
  command->add_option("--device", options->motion.stylus, device_help("recorded"));
  command->add_option("--coupling", options->motion.common.coupling, kCouplingHelp)->check(kCouplings);
  add_scanner_options(*command, options->motion.common.scanner);
  command->add_option("--gpu", options->motion.common.gpu, "GPU by a part of its name or its number");
  add_random(*command, options);
  command->footer(kRenderFooter);
  command->callback([options, &exit_code] {
    exit_code = options->dataset.frames > 0 ? render_dataset(*options) : render_motion(*options);
  });
}

}  // namespace stylet::tools
