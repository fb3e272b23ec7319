#include "engine/app/run_session.h"

#include "engine/app/build_name.h"
#include "engine/app/debrief_recording.h"
#include "engine/app/default_stylus.h"
#include "engine/app/expert_choice.h"
#include "engine/app/graphics.h"
#include "engine/app/headset_session.h"
#include "engine/app/hid_device.h"
#include "engine/app/kept_attempts.h"
#include "engine/app/session_display.h"
#include "engine/app/session_window.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/session_replay.h"
#include "engine/debrief/still_moment.h"
#include "engine/desktop/key_table.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"
#include "engine/recording/unfinished_recording.h"
#include "engine/session/live_session.h"
#include "engine/session/recorder.h"
#include "engine/session/start_pose.h"
#include "engine/training/training_session.h"
#include "physics/tissue/blas.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace stylet::app {

namespace {

/// What an interrupted session does not draw: pictures of an earlier one must not lie beside its numbers.
const std::vector<std::string> kPictures{"session.mp4",  "session.png",  "view.png",    "ultrasound.png",
                                         "debrief.html", "debrief.json", "debrief.csv", "path.csv"};

/// @throws files::ContentError  settings that do not go together
void check(const SessionSettings& settings, const Stylus& stylus, bool window, bool headset) {
  using files::ContentError;
  const StylusNeed need = stylus.kind->need;
  if (settings.lockstep && stylus.kind->in_real_time_only)
    throw ContentError(
        "--lockstep: a HID device moves in real time; leave --lockstep out, or choose another with --device");
  if (settings.lockstep && settings.link.wanted())
    throw ContentError("--lockstep: runs faster than time; leave one of --lockstep and --link out");
  if (need == StylusNeed::link && !settings.link.wanted())
    throw ContentError("--device link: its poses come over --link or --link-from HOST:PORT; say which");
  if (need == StylusNeed::window && (!window || headset))
    throw ContentError("--device mouse: needs a window, and this session has none");
  if (need == StylusNeed::headset && !headset)
    throw ContentError("--device hand: needs a headset, and this session has none; see --view headset");
}

/// Recordings that an earlier session left here when it was killed are never taken away.
void note_cut_off_sessions(const std::filesystem::path& folder, Observer& observer) {
  for (const std::filesystem::path& recording : recording::cut_off_recordings(folder)) {
    observer.note(Note::notice, fmt::format("an earlier session was cut off; `stylet replay {}` shows it, remove it "
                                            "when done",
                                            recording.string()));
  }
}

/// A session that is over.
struct Finished {
  const content::Scene& scene;
  const recording::Recording& recording;
  const figures::ForceTrace& force;
  bool own_motion = false;  ///< the scenario's motion led the needle
  const KeptAttempts& before;
};

/// Replays the recording, then draws page, pictures and film from the replay.
void debrief_session(const SessionSettings& settings, const Finished& done, Graphics& graphics, SessionResult& result,
                     files::OutputDirectory& out, recording::UnfinishedRecording& file, SessionObserver& observer) {
  const auto show = [&](const std::string& doing, double share) { show_progress(observer, doing, share); };
  const auto write_report = [&] {
    nlohmann::ordered_json json = training::with_training(session::to_json(result.report), result.training);
    if (!done.before.empty()) json["attempts_before"] = to_json(done.before.list());
    session::write_json(out.staged("session.json"), json);
    file.finish(out, "session.json");
  };
  const auto keep_numbers = [&] {
    observer.task_done();
    out.keep_only({"force.csv", "force.png"});
    out.supersede(kPictures);
    write_report();
  };
  debrief::write_force(out, done.recording, done.force);
  try {
    debrief::SessionReplay replay(done.scene, done.recording);
    replay.run([&](double share) { show("Replaying", share); });
    observer.task_done();
    result.report.replay_identical = replay.result().identical() && replay.state_hash() == result.report.state_hash;
    result.report.replay_hashes = replay.result().compared;
    observer.measured(result);
    const auto expert = chosen_expert(settings.expert, done.own_motion, done.scene, observer);
    result.film_frames = graphics.draw([&](gpu::Device& device) {
      return debrief::write_debrief(out, {done.scene, done.recording, replay, done.force}, device,
                                    {.stills = {.film = {.stereo = settings.stereo}},
                                     .film = settings.film,
                                     .expert = expert,
                                     .attempts = done.before.list(),
                                     .metrics = result.training.metrics},
                                    show);
    });
  } catch (const Stopped&) {
    return keep_numbers();
  } catch (const gpu::GpuError& error) {
    result.not_drawn_because = error.what();
    return keep_numbers();
  }
  observer.task_done();
  if (!settings.film) out.supersede({"session.mp4"});
  write_report();
  result.drawn = true;
  result.still_moment = debrief::still_words(done.recording.events);
}

/// Where a trainee finds needle and probe; none: as the scenario has them.
std::optional<session::StartPose> drawn_start(const SessionSettings& settings, const content::Scene& scene,
                                              bool watched) {
  const bool led = !scene.targets.empty() && !scene.motion.stylus.empty();
  if (!watched || !led || scene.start.none()) return std::nullopt;
  return session::drawn_start(scene, settings.seed.value_or(std::random_device{}()));
}

/// What the trainee presses, in words of what is in use.
procedures::Controls controls_of(const Stylus& stylus, bool window, bool headset) {
  if (!stylus.held()) return {};
  if (headset) return {.begin = "the menu button", .act = "right trigger"};
  if (!window) return {.begin = "button 1", .act = "button 1"};
  const std::string begin = desktop::key_of(desktop::CourseButton::next);
  const std::string act = desktop::key_of(desktop::CourseButton::sample);
  const bool buttons = stylus.input.mouse == nullptr && stylus.input.tracked == nullptr;
  return {.begin = buttons ? "button 1 or " + begin : begin,
          .act = buttons ? "button 1 or " + act : act,
          .finish = begin};
}

/// @param display  null: headless, or only in the headset
/// @return nothing: the trainee wants to begin anew; what was done until then is kept
std::optional<SessionResult> attempt(const SessionSettings& settings, const content::Scene& scene,
                                     view::Display* display, headset::HeadsetRuntime* headset, KeptAttempts& before,
                                     SessionObserver& observer) {
  const physics::Coupling coupling = chosen_coupling(settings.coupling, scene);
  haptic::hid::ReportLog log;
  const ShownIn shown = headset != nullptr   ? ShownIn::headset
                        : display != nullptr ? ShownIn::window
                                             : ShownIn::nothing;
  const bool watched = display != nullptr || headset != nullptr;
  std::optional<session::StartPose> start = drawn_start(settings, scene, watched);
  Stylus stylus = open_stylus_or_default(settings.stylus, shown, scene, settings.record.empty() ? nullptr : &log,
                                         start ? &*start : nullptr, observer);
  if (!stylus.held()) start.reset();
  if (settings.seconds > 0) stylus.duration_s = std::min(stylus.duration_s, settings.seconds);
  check(settings, stylus, display != nullptr, headset != nullptr);
  Graphics graphics(
      {.gpu = settings.gpu,
       .window_extensions = display != nullptr ? display->vulkan_extensions() : std::vector<std::string>{},
       .maker = headset},
      observer);
  files::OutputDirectory out(settings.out);
  note_cut_off_sessions(out.destination(), observer);
  recording::UnfinishedRecording file(out.destination());
  session::HeldProbe probe(scene, start ? start->probe : content::ProbeMove{});
  training::TraceRecorder trace(scene, stylus.duration_s);
  training::TrainingSession course(scene, {.automatic = !stylus.held() || !watched,
                                           .controls = controls_of(stylus, display != nullptr, headset != nullptr)});
  session::LiveSession live(scene, *stylus.device,
                            {.coupling = coupling,
                             .duration_s = stylus.duration_s,
                             .lockstep = settings.lockstep,
                             .recording = file.path(),
                             .build = build_name(),
                             .probe = watched || settings.link.wanted() ? &probe : nullptr,
                             .start_seed = start ? std::optional(start->seed) : std::nullopt,
                             .listeners = {&trace, &course.watch()}});
  LinkSession link(settings.link, scene, live, {.probe = &probe, .needle = stylus.input.tracked});
  SessionResult result{.title = scene.name, .folder = out.destination()};
  session::SessionReport& report = result.report;
  report = {.scenario = scene.scenario.string(),
            .build = build_name(),
            .coupling = session::coupling_name(coupling),
            .device = stylus.device->name(),
            .start_seed = start ? std::optional(start->seed) : std::nullopt,
            .gpu = graphics.device().identity().name,
            .gpu_driver = graphics.device().identity().driver,
            .blas = physics::single_threaded_blas().name};
  if (const double scale = session::force_scale(scene.hand_force, stylus.device->limits()); scale < 1) {
    observer.note(Note::notice, fmt::format("the stylus gets {}: it gives {:.1f} N, and holds {:.2f} N",
                                            session::force_scale_text(scale), stylus.device->limits().max_force_n,
                                            stylus.device->limits().continuous_force_n));
  }
  file.keep();  // what a hand has done is not done again
  live.start();
  link.start(observer);
  session::PictureWatch pictures;
  show_to_end(live, scene, {graphics, display, headset, stylus, probe, course, link, pictures}, settings.stereo,
              stylus.duration_s, observer);
  course.end(live);
  report.run = live.stop();
  const std::vector<std::string> link_lines = link.stop();
  const bool again = course.reset_asked_for() && !observer.stop_requested();
  if (again && course.state().stage == training::Stage::briefing) {
    file.discard();  // nothing was done
    return std::nullopt;
  }
  if (const std::string counts = stylus.device->statistics(); !counts.empty()) result.account = counts + "\n";
  for (const std::string& line : link_lines) result.account += line + "\n";
  result.account += course.result_in_words();
  observer.task_done();
  if (!again && observer.stop_requested()) {
    observer.note(Note::notice,
                  "session ended early; drawing its pictures (Ctrl-C again: keep recording and force only)");
    observer.stop_answered();
  }
  report.force = live.force().summary();
  report.passivity = live.passivity();
  report.force_output = live.force_output(report.run);
  report.closest_target_distance = live.closest_target_distance();
  report.probe = live.probe();
  if (const session::PictureSummary seen = pictures.summary(); seen.frames > 0) report.pictures = seen;
  report.state_hash = live.state_hash();
  const recording::Recording recording = recording::read_recording(file.path());
  if (!settings.record.empty()) write_hand(live, recording, stylus.hid, log, settings.record);
  stylus.device.reset();  // motors off before the pictures are drawn
  report.punctures = session::punctures(recording.events);
  report.needle_bent_deg = session::needle_bent_deg(recording.events);
  result.training = training::assess(trace.take(recording.events), scene);
  if (again) {
    observer.note(Note::notice, before.keep(file, report, result.training));
    return std::nullopt;
  }
  debrief_session(settings, {scene, recording, live.force(), stylus.own_motion, before}, graphics, result, out, file,
                  observer);
  return result;
}

/// The pages of the attempts before the last. What is not written can be later: `stylet debrief`.
void debrief_attempts(const SessionSettings& settings, const KeptAttempts& before, SessionObserver& observer) {
  try {
    for (const std::filesystem::path& folder : before.folders()) {
      debrief_recording({.recording = folder.string(), .expert = settings.expert, .out = folder, .gpu = settings.gpu},
                        observer);
    }
  } catch (const Stopped&) {
    observer.stop_answered();
    observer.note(Note::notice, "the debriefs of earlier attempts are left out; `stylet debrief FOLDER` writes them");
  }
}

bool wants_window(const SessionSettings& settings) {
  if (settings.view == SessionView::headless) return false;
  if (settings.view == SessionView::window && !has_display()) {
    throw files::ContentError(
        "--view window: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); use --view headless");
  }
  return has_display() && (settings.view != SessionView::automatic || !settings.lockstep);
}

/// A window's display; none for a headless session, or where none can be opened and a window was not insisted on. Of
/// a headset's session the window waits for the headset to go.
std::unique_ptr<view::Display> open_display(const SessionSettings& settings, Observer& observer) {
  if (!wants_window(settings)) return nullptr;
  try {
    return std::make_unique<view::Display>();
  } catch (const gpu::GpuError& error) {
    if (settings.view == SessionView::window) throw;
    observer.note(Note::notice, fmt::format("{}; going on headless", error.what()));
    return nullptr;
  }
}

}  // namespace

SessionResult run_session(const SessionSettings& settings, SessionObserver& observer) {
  const std::unique_ptr<view::Display> display = open_display(settings, observer);
  const std::unique_ptr<headset::HeadsetRuntime> headset =
      settings.view == SessionView::headset ? find_headset(display ? "in a window" : "headless", observer) : nullptr;
  check_expert(settings.expert);
  content::Scene scene = load_scene(settings.scenario, observer);
  if (settings.haptic_hz != 0) set_haptic_rate(scene, settings.haptic_hz);
  set_scanner(scene, settings.scanner);
  KeptAttempts before(settings.out);
  while (true) {
    if (auto result = attempt(settings, scene, display.get(), headset.get(), before, observer)) {
      if (result->drawn) debrief_attempts(settings, before, observer);
      return std::move(*result);
    }
    observer.note(Note::notice, "once more from the start");
  }
}

}  // namespace stylet::app
