// `stylet train`: a session, and what it leaves for the trainee.
#include "engine/content/error.h"
#include "engine/content/scenario.h"
#include "engine/debrief/debrief.h"
#include "engine/gpu/device.h"
#include "engine/session/live_session.h"
#include "engine/session/output_directory.h"
#include "engine/session/session_report.h"
#include "engine/session/unfinished_recording.h"
#include "engine/training/training_report.h"
#include "physics/tissue/blas.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/expert_choice.h"
#include "tools/stylet/hid_device.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/session_window.h"
#include "tools/stylet/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace stylet::tools {

namespace {

struct TrainOptions {
  std::string scenario;
  std::string device;
  std::string view = "auto";
  bool stereo = false;
  bool lockstep = false;
  std::string coupling;
  double haptic_hz = 0;
  double seconds = 0;  // 0: as long as the stylus moves
  std::string record;
  std::string expert;
  std::string out = "out/session";
  std::string gpu;
  ScannerOptions scanner;
};

/// What an interrupted session does not draw: pictures of an earlier one must not lie beside its numbers.
const std::vector<std::string> kPictures{"session.mp4",  "session.png",  "view.png",    "ultrasound.png",
                                         "debrief.html", "debrief.json", "debrief.csv", "path.csv"};

int list_scenarios() {
  const auto folder = content::content_directory() / "scenarios";
  fmt::print("Scenarios in {}:\n", folder.string());
  for (const content::ScenarioEntry& entry : content::list_scenarios(folder)) {
    fmt::print("  {:<24} {}\n", entry.name,
               entry.unreadable_because.empty() ? entry.title : "unreadable: " + entry.unreadable_because);
  }
  fmt::print("Run one with `stylet train NAME`; a path to a scenario file works too.\n");
  return kExitYes;
}

bool want_window(const TrainOptions& options) {
  if (options.view == "headless") return false;
  if (options.view == "window" && !has_display()) {
    throw content::ContentError(
        "--view window: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); use --view headless");
  }
  if (options.view == "window" && options.lockstep) {
    throw content::ContentError("--lockstep: runs without a window; leave one of --lockstep and --view window out");
  }
  return has_display() && !options.lockstep;
}

/// A window's display; none for a headless session, or where --view auto finds that none can be opened.
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

/// Recordings that an earlier session left here when it was killed are never taken away.
void tell_cut_off_sessions(const std::filesystem::path& folder) {
  for (const std::filesystem::path& recording : session::cut_off_recordings(folder)) {
    fmt::print(stderr, "stylet: an earlier session was cut off; `stylet replay {}` shows it, remove it when done\n",
               recording.string());
  }
}

int train(const TrainOptions& options) {
  if (options.scenario.empty()) return list_scenarios();
  const std::unique_ptr<view::Display> display = open_display(options);
  check_expert(options.expert);
  Progress progress;
  content::Scene scene = load_scene(options.scenario, progress);
  if (options.haptic_hz != 0) set_haptic_rate(scene, options.haptic_hz);
  const physics::Coupling coupling = chosen_coupling(options.coupling, scene);
  set_scanner(scene, options.scanner);
  haptic::hid::ReportLog log;
  Stylus stylus = make_stylus(options.device, scene, options.record.empty() ? nullptr : &log);
  if (options.seconds > 0) stylus.duration_s = std::min(stylus.duration_s, options.seconds);
  if (options.lockstep && stylus.hid != nullptr) {
    throw content::ContentError("--lockstep: a HID device moves in real time; leave one of --lockstep and hid out");
  }
  if (!display && stylus.mouse != nullptr) {
    throw content::ContentError("--device mouse: needs a window, and this session has none");
  }
  gpu::Device gpu(
      {.gpu = options.gpu, .window_extensions = display ? display->vulkan_extensions() : std::vector<std::string>{}});
  session::OutputDirectory out(options.out);

  tell_cut_off_sessions(out.destination());
  session::UnfinishedRecording recording_file(out.destination());
  session::HeldProbe probe(scene);
  training::TraceRecorder trace(scene, stylus.duration_s);
  session::LiveSession live(scene, *stylus.device,
                            {.coupling = coupling,
                             .duration_s = stylus.duration_s,
                             .lockstep = options.lockstep,
                             .recording = recording_file.path(),
                             .build = build_name(),
                             .probe = display ? &probe : nullptr,
                             .listeners = {&trace}});
  session::SessionReport report{.scenario = scene.scenario.string(),
                                .build = build_name(),
                                .coupling = session::coupling_name(coupling),
                                .device = stylus.device->name(),
                                .gpu = gpu.identity().name,
                                .gpu_driver = gpu.identity().driver,
                                .blas = physics::single_threaded_blas().name};
  std::int64_t begin_ns = 0;  // CLOCK_MONOTONIC at session time 0
  if (options.lockstep) {
    report.run = live.run_in_lockstep([&](double share) {
      throw_if_interrupted();
      progress.show("Session in lockstep", share);
    });
  } else {
    recording_file.keep();  // what a hand has done is not done again
    live.start();
    begin_ns = haptic::MonotonicClock().now_ns() - static_cast<std::int64_t>(live.time_s() * 1e9);
    if (display)
      show_session(*display, gpu, scene, live,
                   {.stereo = options.stereo,
                    .mouse = stylus.mouse,
                    .hid = stylus.hid,
                    .probe = &probe,
                    .scanner = session::ScannerConsole(scene.probe)});
    StylusWatch watch(stylus.hid);
    while (!display && !live.finished() && !interrupted()) {
      watch.look();
      progress.show("Session in real time", live.time_s() / stylus.duration_s);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    report.run = live.stop();
  }
  const std::string hid_counts = stylus.hid != nullptr ? hid_summary(*stylus.hid) + "\n" : "";
  progress.done();
  if (interrupted()) {
    fmt::print(stderr,
               "stylet: session ended early; drawing its pictures (Ctrl-C again: keep recording and force only)\n");
    clear_interrupt();
  }
  report.force = live.force().summary();
  report.closest_target_distance = live.closest_target_distance();
  report.probe = live.probe();
  report.state_hash = live.state_hash();

  const session::Recording recording = session::read_recording(recording_file.path());
  if (!options.record.empty()) write_hand(recording, stylus.hid, log, begin_ns, options.record);
  stylus.device.reset();  // motors off before the pictures are drawn
  report.punctures = session::punctures(recording);
  const training::TrainingReport training = training::assess(trace.take(recording.events), scene);
  debrief::Debrief done;
  debrief::write_force(out, recording, live.force());
  try {
    const auto expert = chosen_expert(options.expert, options.device.empty(), scene, progress);
    done = debrief::write_debrief(
        out, scene, gpu, recording, live.force(),
        {.stills = {.film = {.stereo = options.stereo}}, .expert = expert, .metrics = training.metrics},
        [&](const std::string& doing, double share) {
          throw_if_interrupted();
          progress.show(doing, share);
        });
  } catch (const Interrupted&) {
    progress.done();
    out.keep_only({"force.csv", "force.png"});
    out.supersede(kPictures);
    session::write_json(out.staged("session.json"), training::with_training(session::to_json(report), training));
    recording_file.finish(out, "session.json");
    fmt::print("{} holds session.rec, session.json and the force; the patient was not drawn\n",
               out.destination().string());
    return kExitInterrupted;
  }
  progress.done();
  report.replay_identical = done.replay.identical() && done.state_hash == report.state_hash;
  report.replay_hashes = done.replay.compared;
  session::write_json(out.staged("session.json"), training::with_training(session::to_json(report), training));
  recording_file.finish(out, "session.json");

  fmt::print("\n{}\n{}{}", scene.name, session::main_figures(report), hid_counts);
  fmt::print("\n{}", training::in_words(training));
  fmt::print("\n{} holds:\n", out.destination().string());
  fmt::print(
      "  debrief.html     score, course, forces, the needle's way and ultrasound; debrief.json and .csv have the "
      "numbers\n"
      "  session.mp4      3-D view, ultrasound and force curve, {} frames\n"
      "  view.png         the 3-D view, when the tip is closest to the target\n"
      "  ultrasound.png   the ultrasound image of the same moment; session.png has both\n"
      "  force.png        the force on the hand; force.csv has the numbers\n"
      "  session.json     what was measured\n"
      "  session.rec      the recording; `stylet replay {}` runs it again\n",
      done.video_frames, (out.destination() / "session.rec").string());
  return *report.replay_identical ? kExitYes : kExitNo;
}

}  // namespace

void add_train(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("train", "Run a training session; without a scenario: list them");
  auto options = std::make_shared<TrainOptions>();
  command->add_option("SCENARIO", options->scenario, "Name of a scenario in content/scenarios, or a file");
  command->add_option("--device", options->device, kDeviceHelp);
  command->add_option("--view", options->view, "auto: a window where there is a display, else headless")
      ->check(CLI::IsMember({"auto", "window", "headless"}))
      ->capture_default_str();
  command->add_flag("--stereo", options->stereo, "Both eyes side by side, drawn in one pass");
  command->add_flag("--lockstep", options->lockstep,
                    "One thread, fixed schedule, as fast as it goes: the same bits every time");
  command->add_option("--coupling", options->coupling, kCouplingHelp);
  command->add_option("--haptic-hz", options->haptic_hz,
                      "Rate of the haptic loop, up to 4000; default: the scenario's");
  command->add_option("--seconds", options->seconds, "End the session after so long; default: when the stylus rests")
      ->check(CLI::PositiveNumber);
  command->add_option("--record", options->record,
                      "Motion file to write: the hand's poses, and the raw reports of a HID device; --device "
                      "recorded:FILE plays it");
  command->add_option("--expert", options->expert, kExpertHelp);
  command->add_option("--out", options->out, "Folder for the results")->capture_default_str();
  add_scanner_options(*command, options->scanner);
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  command->footer(
      "The session runs in real time: a haptic thread (1 kHz) with the needle, a simulation thread (50 Hz) with the\n"
      "tissue, a thread that factorises. Everything is recorded; afterwards the recording is replayed to check that "
      "it\n"
      "gives the same bits, and the pictures are drawn from the replay, so that drawing never disturbs the loops.\n\n"
      "  stylet train liver_biopsy --out out/demo\n"
      "  stylet train liver_biopsy --device hid          a stylus, space mouse or pen; `stylet devices` lists them\n"
      "  stylet train liver_biopsy --device mouse        drag: move the hub; wheel: advance the needle\n"
      "  stylet train liver_biopsy --device recorded:content/motions/liver_biopsy.json --lockstep\n"
      "In the window: H lists the keys of scanner and probe. A tissue table that is saved meanwhile shows in the "
      "image.\n"
      "Ctrl-C ends the session early; what happened until then is kept and drawn.\n"
      "Exit code 0: done; 1: the replay differs; 2: bad input.");
  command->callback([options, &exit_code] { exit_code = train(*options); });
}

}  // namespace stylet::tools
