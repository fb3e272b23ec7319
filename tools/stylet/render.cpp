// `stylet render`: deterministic frames of a scenario for data sets, tests and papers.
#include "tools/stylet/render.h"

#include "engine/files/error.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace stylet::tools {

Size parse_size(const std::string& option, const std::string& text) {
  Size size{};
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) != 2 || size.width < 64 ||
      size.height < 64 || size.width > 8192 || size.height > 8192) {
    throw files::ContentError(
        fmt::format("{} {}: give WIDTHxHEIGHT in pixels, each from 64 to 8192, such as 1280x720", option, text));
  }
  return size;
}

nlohmann::ordered_json scanner_json(const content::Probe& probe) {
  return {{"preset", probe.preset}, {"depth_mm", probe.depth * 1e3}, {"gain_db", probe.gain_db}};
}

nlohmann::ordered_json legend_json(const content::PictureLabels& labels) {
  nlohmann::ordered_json legend = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < labels.names.size(); ++i) {
    legend.push_back({{"index", i}, {"name", labels.names[i]}, {"colour", content::PictureLabels::colour(int(i))}});
  }
  return legend;
}

namespace {

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
    "again: after a crash give the same command again.\n\n"
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
      command.add_option("--random", options->random, "So many random frames instead of those of the motion")
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
  command.add_option("--only", options->only, "Only this frame")->needs(random)->group(group);
  session::RandomRanges& r = options->ranges;
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
  command->add_flag(
      "--ultrasound", options->ultrasound,
      "The ultrasound image alone: grey PNG files and ultrasound.igs.mha, which 3D Slicer and PLUS open");
  command->add_flag(
      "--labels", options->labels,
      "With every picture a label map of the same size: which tissue a pixel shows; legend in the manifest");
  command->add_option("--previews", options->previews, "Every so manyth label map also in colour over its picture")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--stereo", options->stereo, "Both eyes side by side");
  command->add_flag("--room", options->room,
                    "The 3-D view shows the operating room and the drape, not the patient alone");
  command->add_option("--seed", options->seed, "Of speckle and noise")->capture_default_str();
  command->add_option("--device", options->device, kDeviceHelp + std::string("recorded"));
  command->add_option("--coupling", options->coupling, kCouplingHelp);
  add_scanner_options(*command, options->scanner);
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  add_random(*command, options);
  command->footer(kRenderFooter);
  command->callback([options, &exit_code] {
    exit_code = options->random > 0 ? render_dataset(*options) : render_motion(*options);
  });
}

}  // namespace stylet::tools
