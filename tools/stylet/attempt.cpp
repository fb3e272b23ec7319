#include "tools/stylet/attempt.h"

#include "engine/debrief/debrief.h"
#include "engine/debrief/session_replay.h"
#include "engine/debrief/still_moment.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"
#include "engine/recording/unfinished_recording.h"
#include "engine/session/live_session.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"
#include "engine/training/training_session.h"
#include "physics/tissue/blas.h"
#include "tools/stylet/accompany.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/expert_choice.h"
#include "tools/stylet/graphics.h"
#include "tools/stylet/hid_device.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/leader.h"
#include "tools/stylet/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

namespace stylet::tools {

namespace {

/// What an interrupted session does not draw: pictures of an earlier one must not lie beside its numbers.
const std::vector<std::string> kPictures{"session.mp4",  "session.png",  "view.png",    "ultrasound.png",
                                         "debrief.html", "debrief.json", "debrief.csv", "path.csv"};

/// @throws files::ContentError  options that do not go together
void check(const TrainOptions& options, const Stylus& stylus, bool window, bool headset) {
  using files::ContentError;
  if (options.lockstep && stylus.hid != nullptr)
    throw ContentError(
        "--lockstep: a HID device moves in real time; leave --lockstep out, or choose another with --device");
  if (options.lockstep && options.link.wanted())
    throw ContentError("--lockstep: runs faster than time; leave one of --lockstep and --link out");
  if (stylus.link != nullptr && !options.link.wanted())
    throw ContentError("--device link: its poses come over --link or --link-from HOST:PORT; say which");
  if (stylus.mouse != nullptr && (!window || headset))
    throw ContentError("--device mouse: needs a window, and this session has none");
  if (stylus.hand != nullptr && !headset)
    throw ContentError("--device hand: needs a headset, and this session has none; see --view headset");
}

/// Recordings that an earlier session left here when it was killed are never taken away.
void tell_cut_off_sessions(const std::filesystem::path& folder) {
  for (const std::filesystem::path& recording : recording::cut_off_recordings(folder)) {
    fmt::print(stderr, "stylet: an earlier session was cut off; `stylet replay {}` shows it, remove it when done\n",
               recording.string());
  }
}

/// A session that is over, and what is to be said of it.
struct Finished {
  const recording::Recording& recording;
  const figures::ForceTrace& force;
  session::SessionReport& report;
  const training::TrainingReport& training;
  std::string words;        ///< besides what report and training say
  bool own_motion = false;  ///< the scenario's motion led the needle
};

/// Says the numbers, then draws page, pictures and film from the replay. @return exit code
int debrief_session(const TrainOptions& options, const content::Scene& scene, Graphics& graphics, Finished& done,
                    files::OutputDirectory& out, recording::UnfinishedRecording& file, Progress& progress) {
  const auto show = [&](const std::string& doing, double share) {
    throw_if_interrupted();
    progress.show(doing, share);
  };
  const auto write_report = [&] {
    session::write_json(out.staged("session.json"),
                        training::with_training(session::to_json(done.report), done.training));
    file.finish(out, "session.json");
  };
  const auto keep_numbers = [&] {
    progress.done();
    out.keep_only({"force.csv", "force.png"});
    out.supersede(kPictures);
    write_report();
    fmt::print("{} holds session.rec, session.json and the force; the patient was not drawn\n",
               out.destination().string());
  };
  int frames = 0;
  debrief::write_force(out, done.recording, done.force);
  try {
    debrief::SessionReplay replay(scene, done.recording);
    replay.run([&](double share) { show("Replaying", share); });
    progress.done();
    done.report.replay_identical = replay.result().identical() && replay.state_hash() == done.report.state_hash;
    done.report.replay_hashes = replay.result().compared;
    fmt::print("\n{}\n{}{}{}\n", scene.name, session::main_figures(done.report), done.words,
               training::in_words(done.training));
    std::fflush(stdout);
    const auto expert = chosen_expert(options.expert, done.own_motion, scene, progress);
    frames = graphics.draw([&](gpu::Device& device) {
      return debrief::write_debrief(out, scene, device, done.recording, replay, done.force,
                                    {.stills = {.film = {.stereo = options.stereo}},
                                     .film = options.film,
                                     .expert = expert,
                                     .metrics = done.training.metrics},
                                    show);
    });
  } catch (const Interrupted&) {
    keep_numbers();
    return kExitInterrupted;
  } catch (const gpu::GpuError& error) {
    keep_numbers();
    fmt::print(stderr, "stylet: {}\n", error.what());
    return kExitBadInput;
  }
  progress.done();
  if (!options.film) out.supersede({"session.mp4"});
  write_report();
  fmt::print(
      "{} holds:\n"
      "  debrief.html     score, course, forces, the needle's way and ultrasound; debrief.json and .csv have the "
      "numbers\n"
      "{}"
      "  view.png         the 3-D view {}\n"
      "  ultrasound.png   the ultrasound image of the same moment; session.png has both\n"
      "  force.png        the force on the hand; force.csv has the numbers\n"
      "  session.json     what was measured\n"
      "  session.rec      the recording; `stylet replay {}` runs it again\n",
      out.destination().string(),
      frames > 0 ? fmt::format("  session.mp4      3-D view, ultrasound and force curve, {} frames\n", frames) : "",
      debrief::still_words(done.recording.events), (out.destination() / "session.rec").string());
  return *done.report.replay_identical ? kExitYes : kExitNo;
}

}  // namespace

std::optional<int> attempt(const TrainOptions& options, const content::Scene& scene, view::Display* display,
                           headset::HeadsetRuntime* headset, Progress& progress) {
  const physics::Coupling coupling = chosen_coupling(options.coupling, scene);
  haptic::hid::ReportLog log;
  const Seen seen = headset != nullptr ? Seen::in_headset : display != nullptr ? Seen::in_window : Seen::headless;
  Stylus stylus = make_leader(options.device, seen, scene, options.record.empty() ? nullptr : &log);
  if (options.seconds > 0) stylus.duration_s = std::min(stylus.duration_s, options.seconds);
  check(options, stylus, display != nullptr, headset != nullptr);
  Graphics graphics(
      {.gpu = options.gpu,
       .window_extensions = display != nullptr ? display->vulkan_extensions() : std::vector<std::string>{},
       .maker = headset});
  files::OutputDirectory out(options.out);
  tell_cut_off_sessions(out.destination());
  recording::UnfinishedRecording file(out.destination());
  session::HeldProbe probe(scene);
  training::TraceRecorder trace(scene, stylus.duration_s);
  const bool watched = display != nullptr || headset != nullptr;
  training::TrainingSession course(scene, {.automatic = !stylus.held() || !watched});
  session::LiveSession live(scene, *stylus.device,
                            {.coupling = coupling,
                             .duration_s = stylus.duration_s,
                             .lockstep = options.lockstep,
                             .recording = file.path(),
                             .build = build_name(),
                             .probe = watched || options.link.wanted() ? &probe : nullptr,
                             .listeners = {&trace, &course.watch()}});
  LinkSession link(options.link, scene, live, {.probe = &probe, .needle = stylus.link});
  session::SessionReport report{.scenario = scene.scenario.string(),
                                .build = build_name(),
                                .coupling = session::coupling_name(coupling),
                                .device = stylus.device->name(),
                                .gpu = graphics.device().identity().name,
                                .gpu_driver = graphics.device().identity().driver,
                                .blas = physics::single_threaded_blas().name};
  file.keep();  // what a hand has done is not done again
  live.start();
  link.start();
  accompany(live, scene, {graphics, display, headset, stylus, probe, course, link}, options.stereo, stylus.duration_s,
            progress);
  course.end(live);
  report.run = live.stop();
  const std::vector<std::string> link_lines = link.stop();
  if (course.reset_asked_for() && !interrupted()) {
    file.discard();
    return std::nullopt;
  }
  std::string words = stylus.hid != nullptr ? hid_summary(*stylus.hid) + "\n" : "";
  for (const std::string& line : link_lines) words += line + "\n";
  words += course.result_in_words();
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
  const recording::Recording recording = recording::read_recording(file.path());
  if (!options.record.empty()) write_hand(live, recording, stylus.hid, log, options.record);
  stylus.device.reset();  // motors off before the pictures are drawn
  report.punctures = session::punctures(recording.events);
  const training::TrainingReport training = training::assess(trace.take(recording.events), scene);
  Finished done{recording, live.force(), report, training, std::move(words), stylus.own_motion};
  return debrief_session(options, scene, graphics, done, out, file, progress);
}

}  // namespace stylet::tools
