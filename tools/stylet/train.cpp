// `stylet train`: a session, and what it leaves for the trainee.
#include "engine/files/error.h"
#include "engine/gpu/error.h"
#include "engine/readers/scenario.h"
#include "tools/stylet/attempt.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/expert_choice.h"
#include "tools/stylet/headset_session.h"
#include "tools/stylet/leader.h"
#include "tools/stylet/session_window.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

namespace stylet::tools {

namespace {

int list_scenarios() {
  const auto folder = readers::content_directory() / "scenarios";
  fmt::print("Scenarios in {}:\n", folder.string());
  for (const readers::ScenarioEntry& entry : readers::list_scenarios(folder)) {
    fmt::print("  {:<24} {}\n", entry.name,
               entry.unreadable_because.empty() ? entry.title : "unreadable: " + entry.unreadable_because);
  }
  fmt::print("Run one with `stylet train NAME`; a path to a scenario file works too.\n");
  return kExitYes;
}

bool want_window(const TrainOptions& options) {
  if (options.view == "headless") return false;
  if (options.view == "window" && !has_display()) {
    throw files::ContentError(
        "--view window: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); use --view headless");
  }
  return has_display() && (options.view != "auto" || !options.lockstep);
}

/// A window's display; none for a headless session, or where --view auto or headset finds that none can be opened. Of
/// a headset's session the window waits for the headset to go.
std::unique_ptr<view::Display> open_display(const TrainOptions& options) {
  if (!want_window(options)) return nullptr;
  try {
    return std::make_unique<view::Display>();
  } catch (const gpu::GpuError& error) {
    if (options.view == "window") throw;
    fmt::print(stderr, "stylet: {}; going on headless\n", error.what());
    return nullptr;
  }
}

int train(const TrainOptions& options) {
  if (options.scenario.empty()) return list_scenarios();
  const std::unique_ptr<view::Display> display = open_display(options);
  const std::unique_ptr<headset::HeadsetRuntime> headset =
      options.view == "headset" ? find_headset(display ? "in a window" : "headless") : nullptr;
  check_expert(options.expert);
  Progress progress;
  content::Scene scene = load_scene(options.scenario, progress);
  if (options.haptic_hz != 0) set_haptic_rate(scene, options.haptic_hz);
  set_scanner(scene, options.scanner);
  while (true) {
    if (const std::optional<int> code = attempt(options, scene, display.get(), headset.get(), progress)) return *code;
    fmt::print(stderr, "stylet: once more from the start\n");
  }
}

}  // namespace

void add_train(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("train", "Run a training session; without a scenario: list them");
  auto options = std::make_shared<TrainOptions>();
  command->add_option("SCENARIO", options->scenario, "Name of a scenario in content/scenarios, or a file");
  command->add_option("--device", options->device, kDeviceHelp + std::string(kLeaderHelp));
  command
      ->add_option("--view", options->view,
                   "auto: a window where there is a display, else headless, as is --lockstep; headset: OpenXR, and "
                   "where no runtime answers as auto")
      ->check(CLI::IsMember({"auto", "window", "headset", "headless"}))
      ->capture_default_str();
  command->add_flag("--stereo", options->stereo, "Both eyes side by side, drawn in one pass");
  command->add_flag(
      "--lockstep", options->lockstep,
      "One thread, fixed schedule: the same bits every time. Headless as fast as it goes; in a window or "
      "headset a picture every 1/60 s of the session, for which time waits");
  command->add_option("--coupling", options->coupling, kCouplingHelp);
  command->add_option("--haptic-hz", options->haptic_hz,
                      "Rate of the haptic loop, up to 4000; default: the scenario's");
  command->add_option("--seconds", options->seconds, "End the session after so long; default: when the stylus rests")
      ->check(CLI::PositiveNumber);
  command->add_option("--record", options->record,
                      "Motion file to write: the hand's poses, and the raw reports of a HID device; --device "
                      "recorded:FILE plays it");
  command->add_option("--expert", options->expert, kExpertHelp);
  command->add_flag("!--no-film", options->film,
                    "Leave out the film, which takes a processor minutes; `stylet replay` makes one later");
  command->add_option("--out", options->out, "Folder for the results")->capture_default_str();
  add_scanner_options(*command, options->scanner);
  add_link_options(*command, options->link);
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  command->footer(
      "The session runs in real time: a haptic thread (1 kHz) with the needle, a simulation thread (50 Hz) with the\n"
      "tissue, a thread that factorises. Everything is recorded; afterwards the recording is replayed to check that "
      "it\n"
      "gives the same bits, and the pictures are drawn from the replay, so that drawing never disturbs the loops.\n\n"
      "  stylet train liver_biopsy                       you lead the needle: H lists the keys\n"
      "  stylet train liver_biopsy --device hid          a stylus, space mouse or pen; `stylet devices` lists them\n"
      "  stylet train liver_biopsy --device recorded     the scenario's own motion, as a demonstration\n"
      "  stylet train liver_biopsy --device recorded:content/motions/liver_biopsy.json --lockstep\n"
      "  stylet train liver_biopsy --link                3D Slicer connects to localhost:18944\n"
      "  stylet train liver_biopsy --link --device link  and a tracked needle drives the needle\n"
      "In the window: Enter begins and finishes, T fires or heats, X pauses, Backspace tries again; H lists the keys "
      "of "
      "scanner and probe. A tissue table that is saved meanwhile shows in the "
      "image.\n"
      "In a headset: the menu button begins and pauses, the right trigger fires or heats, the left one freezes the\n"
      "image, the left stick turns gain and depth, A, X or the pad goes through the panel, the instructor's panel\n"
      "with a transparent patient, and none.\n"
      "Ctrl-C ends the session early; what happened until then is kept and drawn.\n"
      "Exit code 0: done; 1: the replay differs; 2: bad input.");
  command->callback([options, &exit_code] { exit_code = train(*options); });
}

}  // namespace stylet::tools
