#include "engine/app/run_session.h"

#include "engine/app/build_name.h"
#include "engine/app/default_stylus.h"
#include "engine/app/expert_choice.h"
#include "engine/app/graphics.h"
#include "engine/app/headset_session.h"
#include "engine/app/hid_device.h"
#include "engine/app/kept_attempts.h"
#include "engine/app/kept_in_lab.h"
#include "engine/app/probe_device.h"
#include "engine/app/saved_images.h"
#include "engine/app/session_display.h"
#include "engine/app/session_end.h"
#include "engine/app/session_sound.h"
#include "engine/app/session_window.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/live_footage.h"
#include "engine/desktop/key_table.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"
#include "engine/readers/scenario.h"
#include "engine/readers/texts_file.h"
#include "engine/recording/unfinished_recording.h"
#include "engine/session/live_session.h"
#include "engine/session/recorder.h"
#include "engine/session/start_pose.h"
#include "engine/sound/speaker.h"
#include "engine/training/sound_watch.h"
#include "engine/training/training_session.h"
#include "physics/tissue/blas.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace stylet::app {

namespace {

/// @throws files::ContentError  settings that do not go together
void check(const SessionSettings& settings, const StylusKind& stylus, bool window, bool headset) {
  using files::ContentError;
  const StylusNeed need = stylus.need;
  if (settings.lockstep && stylus.in_real_time_only)
    throw ContentError(
        "--lockstep: a HID device moves in real time; leave --lockstep out, or choose another with --device");
  if (settings.lockstep && !settings.probe_device.empty())
    throw ContentError("--lockstep: a HID device moves in real time; leave one of --lockstep and --probe-device out");
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

/// The folder for the results, which can be written to, and has room for each of them: what a hand has done for half
/// an hour must not be lost to a name that was taken all the while. @throws files::ContentError
std::filesystem::path room_for_results(const std::filesystem::path& folder) {
  const files::OutputDirectory out(folder);
  std::vector<std::string> names{"session.rec", "session.json", "force.csv", "force.png"};
  names.insert(names.end(), kDrawnFiles.begin(), kDrawnFiles.end());
  out.require_places(names);
  return out.destination();
}

/// The numbers of a session, complete before anything is made of them.
/// @throws files::ContentError
void keep_numbers(const SessionSettings& settings, const recording::Recording& recording,
                  const figures::ForceTrace& force, const scanner::SavedImages& saved, const SessionResult& result,
                  const KeptAttempts& before, recording::UnfinishedRecording& file) {
  files::OutputDirectory out(settings.out);
  debrief::write_force(out, recording, force);
  out.named_in_place(
      [&] { session::write_json(out.staged("session.json"), numbers_of(result.report, result.training, before)); });
  write_images(saved, out);
  std::vector<std::string> superseded{kDrawnFiles.begin(), kDrawnFiles.end()};
  for (std::size_t n = 1; n <= scanner::kMostSavedImages; ++n) superseded.push_back(scanner::saved_image_name(n));
  out.supersede(std::move(superseded));
  file.finish(out, "session.json");
}

/// What stays from one session to the next.
struct Station {
  std::optional<Graphics> graphics{};
  Screen* screen = nullptr;                    ///< null: no window
  headset::HeadsetRuntime* headset = nullptr;  ///< null: no headset
  std::optional<sound::Speaker> speaker{};     ///< none: nobody is there to hear it
};

/// Where a trainee finds needle and probe; none: as the scenario has them.
std::optional<session::StartPose> drawn_start(const SessionSettings& settings, const content::Scene& scene,
                                              bool watched) {
  const bool led = !scene.targets.empty() && !scene.motion.stylus.empty();
  if (!watched || !led || scene.start.none()) return std::nullopt;
  return session::drawn_start(scene, settings.seed.value_or(std::random_device{}()));
}

/// What the trainee presses, in words of what is in use.
procedures::Controls controls_of(const Stylus& stylus, bool window, bool headset, bool left_handed) {
  if (!stylus.held()) return {};
  if (headset) return {.begin = "the menu button", .act = left_handed ? "left trigger" : "right trigger"};
  if (!window) return {.begin = "button 1", .act = "button 1"};
  const std::string begin = desktop::key_of(desktop::CourseButton::next);
  const std::string act = desktop::key_of(desktop::CourseButton::sample);
  const bool buttons = stylus.input.mouse == nullptr && stylus.input.tracked == nullptr;
  return {.begin = buttons ? "button 1 or " + begin : begin,
          .act = buttons ? "button 1 or " + act : act,
          .finish = begin};
}

/// How an attempt ended.
struct Attempted {
  std::optional<SessionResult> result{};  ///< none: the trainee began anew before its end
  AfterSession after = AfterSession::again;
};

/// @param next  title of the scenario that comes next; empty: there is none
/// @param before  what was done of an attempt that the trainee breaks off is kept there
/// @param records  of the lab; null: of none
Attempted attempt(const SessionSettings& settings, const content::Scene& scene, Station& station,
                  const std::string& next, KeptAttempts& before, TraineeRecords* records, SessionObserver& observer) {
  Screen* const screen = station.screen;
  headset::HeadsetRuntime* const headset = station.headset;
  const physics::Coupling coupling = chosen_coupling(settings.coupling, scene);
  haptic::hid::ReportLog log;
  const ShownIn shown = headset != nullptr  ? ShownIn::headset
                        : screen != nullptr ? ShownIn::window
                                            : ShownIn::nothing;
  const bool watched = screen != nullptr || headset != nullptr;
  std::optional<session::StartPose> start = drawn_start(settings, scene, watched);
  Stylus stylus = open_stylus_or_default(settings.stylus, shown, scene, settings.record.empty() ? nullptr : &log,
                                         start ? &*start : nullptr, observer);
  if (!stylus.held()) start.reset();
  if (settings.seconds > 0) stylus.duration_s = std::min(stylus.duration_s, settings.seconds);
  check(settings, *stylus.kind, screen != nullptr, headset != nullptr);
  if (!station.graphics || headset != nullptr) {
    if (screen != nullptr) screen->close();
    station.graphics.emplace(
        gpu::DeviceSettings{.gpu = settings.gpu,
                            .window_extensions = screen != nullptr ? screen->display().vulkan_extensions()
                                                                   : std::vector<std::string>{},
                            .maker = headset},
        observer);
  }
  Graphics& graphics = *station.graphics;
  const std::filesystem::path folder = room_for_results(settings.out);
  note_cut_off_sessions(folder, observer);
  recording::UnfinishedRecording file(folder);
  session::HeldProbe probe(scene, start ? start->probe : content::ProbeMove{});
  std::optional<ProbeDevice> probe_device;
  if (!settings.probe_device.empty()) probe_device.emplace(settings.probe_device, stylus.path, scene, probe);
  session::HeldBreath breath(scene.breathing, stylus.breath_button > 0 ? 1U << (stylus.breath_button - 1) : 0U);
  // Who leads the needle asks for it by key, by controller or by the stylus; other sessions have the scene's holds.
  const bool asks = stylus.held() && watched && breath.breathes();
  training::TraceRecorder trace(scene, stylus.duration_s);
  std::optional<LabAttempt> in_lab;
  if (records != nullptr) {
    in_lab.emplace(*records, scene,
                   LabAttempt::Facts{.stylus = stylus.device->name(),
                                     .by_hand = stylus.held(),
                                     .loop_mode = settings.lockstep ? "lockstep" : "threaded"});
  }
  training::TrainingSession course(
      scene, {.automatic = !stylus.held() || !watched,
              .controls = controls_of(stylus, screen != nullptr, headset != nullptr, settings.left_handed),
              .begun = in_lab ? std::function<void()>([&] { in_lab->begin(); }) : nullptr});
  debrief::LiveFootage footage(scene);
  session::PunctureWatch punctures;
  training::SoundWatch heard(scene, trace);
  std::optional<SessionSound> sound;
  if (station.speaker) sound.emplace(*station.speaker, heard, observer);
  std::vector<session::StepListener*> listeners{&trace, &course.watch(), &footage, &punctures};
  if (sound) listeners.push_back(&heard);
  if (asks) listeners.push_back(&breath);
  if (probe_device) listeners.push_back(&probe_device->skin());
  session::LiveSession live(scene, *stylus.device,
                            {.coupling = coupling,
                             .duration_s = stylus.duration_s,
                             .lockstep = settings.lockstep,
                             .recording = file.path(),
                             .build = build_name(),
                             .probe = watched || settings.link.wanted() || probe_device ? &probe : nullptr,
                             .start_seed = start ? std::optional(start->seed) : std::nullopt,
                             .listeners = listeners});
  footage.watch(live.frames());
  LinkSession link(settings.link, scene, live, {.probe = &probe, .needle = stylus.input.tracked});
  SessionResult result{.title = scene.name, .folder = folder};
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
  std::jthread probe_hand;  // after `live`, which it looks at: whatever ends this ends it first
  if (probe_device) {
    observer.note(Note::info, fmt::format("the probe is led by {}{}", probe_device->name(),
                                          probe_device->feels()
                                              ? "; you feel the skin: at once if you lift it off first, else its "
                                                "force rises by itself within three seconds"
                                              : ""));
    if (const std::string warning = probe_device->warning(); !warning.empty()) {
      observer.note(Note::notice, warning);
    }
    probe_hand = probe_device->lead(live);
  }
  session::PictureWatch pictures;
  scanner::SavedImages saved;
  const SessionParts parts{.graphics = graphics,
                           .screen = screen,
                           .headset = headset,
                           .stylus = stylus,
                           .probe = probe,
                           .breath = asks ? &breath : nullptr,
                           .course = course,
                           .link = link,
                           .pictures = pictures,
                           .punctures = punctures,
                           .sound = sound ? &*sound : nullptr,
                           .saved = saved,
                           .left_handed = settings.left_handed,
                           .probe_device = probe_device ? &probe_device->device() : nullptr};
  SessionShown end = show_to_end(live, scene, parts, settings.stereo, stylus.duration_s, observer);
  if (sound) sound->hush();
  // Who leaves in the middle, or begins anew, has broken it off; where nothing finishes it (in a headset, headless),
  // leaving is its end.
  const bool to_its_end = course.state().stage == training::Stage::debrief ||
                          ((live.finished() || !end.could_finish) && !course.reset_asked_for());
  if (!to_its_end) mark_broken_off(live, course);
  course.end(live);
  probe_hand = {};
  report.run = live.stop();
  const std::vector<std::string> link_lines = link.stop();
  const bool again = course.reset_asked_for() && !observer.stop_requested();
  if (again && course.state().stage == training::Stage::briefing) {
    file.discard();  // nothing was done
    return {};
  }
  if (const std::string counts = stylus.device->statistics(); !counts.empty()) result.account = counts + "\n";
  for (const std::string& line : link_lines) result.account += line + "\n";
  result.procedure = course.result_in_words();
  result.account += result.procedure;
  observer.task_done();
  report.force = live.force().summary();
  report.passivity = live.passivity();
  report.force_output = live.force_output(report.run);
  report.closest_target_distance = live.closest_target_distance();
  report.probe = live.probe();
  if (const session::PictureSummary seen = pictures.summary(); seen.frames > 0) report.pictures = seen;
  report.saved_images = facts_of(saved);
  report.state_hash = live.state_hash();
  const recording::Recording recording = recording::read_recording(file.path());
  stylus.device.reset();  // motors off before the pictures are drawn
  stylus.input = {};
  report.punctures = session::punctures(recording.events);
  report.needle_bent_deg = session::needle_bent_deg(recording.events);
  result.training = training::assess(trace.take(recording.events), scene);
  if (in_lab) result.not_kept_because = in_lab->end(report, result.training, to_its_end, file.path());
  if (!result.not_kept_because.empty()) observer.note(Note::notice, result.not_kept_because);
  if (!settings.record.empty()) write_hand(live, recording, stylus.hid, log, settings.record);
  if (again) {
    observer.note(Note::notice, before.keep(file, report, result.training, saved));
    return {};
  }
  keep_numbers(settings, recording, live.force(), saved, result, before, file);
  footage.complete(result.training.trace, course.shown(),
                   recording.haptic.empty() ? 0 : recording.haptic.back().time_s);

  SessionEnd rest(settings, {scene, recording, footage, live.force(), stylus.own_motion, before}, result, graphics,
                  observer);
  const bool stopped = observer.stop_requested();
  if (stopped) {
    observer.stop_answered();  // before it is said: who reads it may ask again at once
    observer.note(Note::notice,
                  "session ended early; drawing its pictures (Ctrl-C again: keep what is written by then)");
  }
  if (end.window && !stopped) {
    result.waits_for_user = stylus.held() && !(settings.seconds > 0);
    const auto reopen = [&] { return open_session_window(live, scene, parts, settings.stereo); };
    const AfterSession after = rest.show(std::move(end.window), *screen, reopen, next);
    return {.result = std::move(result), .after = after};
  }
  rest.finish();
  return {.result = std::move(result), .after = AfterSession::leave};
}

bool wants_window(const SessionSettings& settings) {
  if (settings.view == SessionView::headless) return false;
  if (settings.view == SessionView::window && !has_display()) {
    throw files::ContentError(
        "--view window: there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set); use --view headless");
  }
  return has_display() && (settings.view != SessionView::automatic || !settings.lockstep);
}

/// The window, not open yet; none for a headless session, or where there is no display and a window was not insisted
/// on. Of a headset's session the window waits for the headset to go.
std::unique_ptr<Screen> find_screen(const SessionSettings& settings, Observer& observer) {
  if (!wants_window(settings)) return nullptr;
  try {
    return std::make_unique<Screen>();
  } catch (const gpu::GpuError& error) {
    if (settings.view == SessionView::window) throw;
    observer.note(Note::notice, fmt::format("{}; going on headless", error.what()));
    return nullptr;
  }
}

content::Scene scene_of(const SessionSettings& settings, Observer& observer) {
  content::Scene scene = load_scene(settings.scenario, observer);
  if (settings.haptic_hz != 0) set_haptic_rate(scene, settings.haptic_hz);
  set_scanner(scene, settings.scanner);
  return scene;
}

/// "Liver biopsy" of "Liver biopsy: a 23 mm tumour ...".
std::string short_title(const std::string& title) {
  return title.substr(0, title.find(':'));
}

/// The scenario after that of `scene` among the shipped ones, round and round; none: it is none of them, or the only.
std::optional<readers::ScenarioEntry> scenario_after(const content::Scene& scene) {
  std::vector<readers::ScenarioEntry> all = readers::list_scenarios(scene.scenario.parent_path());
  std::erase_if(all, [](const readers::ScenarioEntry& entry) { return !entry.unreadable_because.empty(); });
  const auto at = std::ranges::find_if(
      all, [&](const readers::ScenarioEntry& entry) { return entry.path.filename() == scene.scenario.filename(); });
  if (at == all.end() || all.size() < 2) return std::nullopt;
  return *(at + 1 == all.end() ? all.begin() : at + 1);
}

/// OUT-2, OUT-3, ...: the first that is not there.
std::filesystem::path folder_beside(const std::filesystem::path& out) {
  std::filesystem::path clean = out.lexically_normal();
  if (!clean.has_filename()) clean = clean.parent_path();
  for (int n = 2;; ++n) {
    std::filesystem::path beside = clean;
    beside += fmt::format("-{}", n);
    std::error_code error;
    if (!std::filesystem::exists(beside, error)) return beside;
  }
}

}  // namespace

SessionResult run_session(const SessionSettings& wanted, SessionObserver& observer) {
  SessionSettings settings = wanted;
  const StylusKind* stylus = settings.stylus.empty() ? nullptr : &find_stylus(settings.stylus);
  Station station;  // its device outlives the window
  const std::unique_ptr<Screen> screen = find_screen(settings, observer);
  const std::unique_ptr<headset::HeadsetRuntime> headset =
      settings.view == SessionView::headset ? find_headset(screen ? "in a window" : "headless", observer) : nullptr;
  if (stylus != nullptr) check(settings, *stylus, screen != nullptr, headset != nullptr);  // loading takes seconds
  check_expert(settings.expert);
  const std::unique_ptr<TraineeRecords> records = open_records(settings.trainee, settings.scenario, observer);
  if (screen) screen->texts = readers::find_texts(settings.language);
  if (screen && settings.left_handed) screen->arrangement.panels.apply(desktop::PanelCommand::other_hand);
  station.screen = screen.get();
  station.headset = headset.get();
  if (screen || headset) station.speaker.emplace(settings.mute);
  while (true) {
    const content::Scene scene = scene_of(settings, observer);
    if (screen) {  // panels as they were, knobs and camera are of the scenario
      screen->arrangement.scanner = scanner::ScannerConsole(scene.probe);
      screen->arrangement.camera.reset();
      screen->arrangement.home.reset();
    }
    const auto next = scenario_after(scene);
    KeptAttempts before(settings.out);
    Attempted done;
    do {
      if (screen) screen->arrangement.scanner.apply(scanner::Freeze{false});  // of the attempt before
      done = attempt(settings, scene, station, next ? short_title(next->title) : "", before, records.get(), observer);
      if (!done.result) {
        observer.note(Note::notice, "once more from the start");
        continue;
      }
      if (done.after == AfterSession::leave) return *std::move(done.result);
      if (done.after == AfterSession::again)
        done.result->folder = before.put_aside(done.result->report, done.result->training);
      observer.left(*done.result);
    } while (done.after == AfterSession::again);
    settings.scenario = next->path.string();
    settings.out = folder_beside(wanted.out);
  }
}

}  // namespace stylet::app
