// `stylet train`: a session, and what it leaves for the trainee.
#include "tools/stylet/train.h"

#include "engine/app/ask_trainee.h"
#include "engine/app/build_name.h"
#include "engine/app/default_stylus.h"
#include "engine/app/deliver_statements.h"
#include "engine/app/kept_in_lab.h"
#include "engine/app/menu_window.h"
#include "engine/app/session_window.h"
#include "engine/files/error.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/station.h"
#include "engine/readers/scenario.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

namespace stylet::tools {

namespace {

int list_scenarios() {
  const auto folder = readers::content_directory() / "scenarios";
  say(stdout, "Scenarios in {}:\n", folder.string());
  for (const readers::ScenarioEntry& entry : readers::list_scenarios(folder)) {
    say(stdout, "  {:<24} {}\n", entry.name,
        entry.unreadable_because.empty() ? entry.title : "unreadable: " + entry.unreadable_because);
  }
  say(stdout, "Run one with `stylet train NAME`; a path to a scenario file works too.\n");
  return kExitYes;
}

const std::map<std::string, app::SessionView> kViews{{"auto", app::SessionView::automatic},
                                                     {"window", app::SessionView::window},
                                                     {"headset", app::SessionView::headset},
                                                     {"headless", app::SessionView::headless}};

void print_folder(const app::SessionResult& result) {
  const std::string folder = result.folder.string();
  const std::string recording = (result.folder / "session.rec").string();
  if (!result.page_written) {
    say(stdout, "{} holds session.rec, session.json and the force; the patient was not drawn\n", folder);
    return;
  }
  say(stdout,
      "{} holds:\n"
      "  debrief.html     score, course, forces, the needle's way and ultrasound; debrief.json and .csv have the "
      "numbers\n"
      "{}{}"
      "  force.png        the force on the hand; force.csv has the numbers\n"
      "  session.json     what was measured\n"
      "  session.rec      the recording; `stylet replay {}` runs it again{}\n"
      "{}",
      folder,
      result.film_frames > 0
          ? fmt::format("  session.mp4      3-D view, ultrasound and force curve, {} frames\n", result.film_frames)
          : "",
      result.drawn ? fmt::format("  view.png         the 3-D view {}\n"
                                 "  ultrasound.png   the ultrasound image of the same moment; session.png has both\n",
                                 result.still_moment)
                   : "",
      recording,
      result.film_frames > 0 ? "" : fmt::format(", `stylet replay {} --out FOLDER` makes a film", recording),
      result.report.saved_images.empty()
          ? ""
          : fmt::format("  ultrasound-*.png {} saved in the session\n", result.report.saved_images.size()));
}

/// What waits for the lab's record store, once; where that is away, what waits goes on waiting.
void tell_record_store(const app::TraineeSettings& trainee) {
  try {
    lab::store::Lab lab(
        {.folder = trainee.lab.empty() ? lab::store::default_lab_folder() : trainee.lab, .build = app::build_name()});
    if (!lab::store::server_of(lab, {}).empty()) return;  // that server's, by who has the key: `stylet lab send`
    const auto delivery = app::deliver_statements(lab);
    if (delivery && delivery->left.waiting > 0) say(stderr, "stylet: {}\n", app::delivery_words(*delivery));
  } catch (const files::ContentError& error) {
    say(stderr, "stylet: the record store is not told: {}\n", error.what());
  }
}

}  // namespace

int run_training(const TrainOptions& options) {
  app::SessionSettings settings = options.session;
  settings.view = kViews.at(options.view);
  settings.link = link_settings(options.link);
  Terminal terminal;
  if (options.ask_trainee && !app::ask_trainee(settings, terminal)) return kExitInterrupted;
  const app::SessionResult result = app::run_session(settings, terminal);
  print_folder(result);
  if (!settings.trainee.name.empty()) {
    app::hand_over_after(settings.trainee, terminal);
    tell_record_store(settings.trainee);
  }
  if (!result.not_kept_because.empty()) return kExitBadInput;  // said when it was known
  if (result.drawn || result.waits_for_user) return result.replay_differs() ? kExitNo : kExitYes;
  if (result.not_drawn_because.empty()) return kExitInterrupted;
  say(stderr, "stylet: {}\n", result.not_drawn_because);
  return kExitBadInput;
}

std::optional<int> run_menu() {
  if (!app::has_display()) return std::nullopt;
  say(stdout, "Choose in the window; `stylet --help` lists the commands.\n");
  std::fflush(stdout);
  Terminal terminal;
  int exit_code = kExitYes;
  app::run_from_menu({}, terminal, [&](const app::SessionSettings& settings, const app::SessionResult& result) {
    print_folder(result);
    if (!settings.trainee.name.empty()) {
      app::hand_over_after(settings.trainee, terminal);
      tell_record_store(settings.trainee);
    }
    if (result.replay_differs()) exit_code = kExitNo;
  });
  return exit_code;
}

void add_session_options(CLI::App& command, TrainOptions& options) {
  app::SessionSettings& session = options.session;
  command.add_option("--device", session.stylus, device_help(app::kDefaultStylusHelp));
  command.add_option(
      "--probe-device", session.probe_device,
      "Who leads the probe: hid, hid:VID:PID, haply, force_dimension, openhaptics or a path of `stylet devices`, "
      "another than --device; a stylus, which feels the skin where it has motors, or a space mouse");
  command
      .add_option("--view", options.view,
                  "auto: a window where there is a display, else headless, as is --lockstep; headset: OpenXR, and "
                  "where no runtime answers as auto")
      ->check(CLI::IsMember({"auto", "window", "headset", "headless"}))
      ->capture_default_str();
  command.add_flag("--mute", session.mute, "Without sound; F7 in the window turns it on");
  command.add_flag("--stereo", session.stereo, "Both eyes side by side, drawn in one pass");
  command.add_flag(
      "--lockstep", session.lockstep,
      "One thread, fixed schedule: the same bits every time. Headless as fast as it goes; in a window or "
      "headset a picture every 1/60 s of the session, for which time waits");
  command.add_option("--coupling", session.coupling, kCouplingHelp)->check(kCouplings);
  command.add_option("--haptic-hz", session.haptic_hz,
                     "Rate of the haptic loop, up to 4000; default: the scenario's");
  command.add_option("--seconds", session.seconds, "End the session after so long; default: when the stylus rests")
      ->check(seconds_above_zero());
  command.add_option("--seed", session.seed,
                     "Start of who leads the needle, drawn from this number: the same one, the same start; default: "
                     "drawn anew each time, and kept in session.json and the recording");
  command.add_option("--record", session.record,
                     "Motion file to write: the hand's poses, and the raw reports of a HID device; --device "
                     "recorded:FILE plays it");
  command.add_option("--expert", session.expert, kExpertHelp);
  command.add_flag("!--no-film", session.film,
                   "Leave out the film, which takes a processor minutes; `stylet replay` makes one later");
  command.add_option("--out", session.out, "Folder for the results")->capture_default_str();
  add_scanner_options(command, session.scanner);
  add_link_options(command, options.link);
  command.add_option("--language", session.language,
                     "Of the window: en, de, or another that content/texts has; default: that of the environment");
  command.add_flag(
      "--left-handed", session.left_handed,
      "Mirrored: in the window the ultrasound is on the left; in a headset the left hand holds the needle");
  command.add_option("--gpu", session.gpu, "GPU by a part of its name or its number");
}

void add_train(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("train", "Run a training session; without a scenario: list them");
  auto options = std::make_shared<TrainOptions>();
  app::SessionSettings& session = options->session;
  command->add_option("SCENARIO", session.scenario, "Name of a scenario in content/scenarios, or a file");
  add_session_options(*command, *options);
  CLI::Option* trainee = command->add_option(
      "--trainee", session.trainee.name,
      "Name or pseudonym: the attempts are kept in the lab's records, from when the procedure begins; `stylet lab`");
  trainee->check([](const std::string& name) { return name.empty() ? std::string("names nobody") : std::string(); });
  command->add_option("--course", session.trainee.course,
                      "The course that the attempts are of: a name in content/courses, or a file");
  command
      ->add_flag("--ask-trainee", options->ask_trainee,
                 "Asks in the window or headset, by name and PIN (`stylet lab pin`), where the lab has names")
      ->excludes(trainee);
  command->add_option("--lab", session.trainee.lab, kLabHelp);
  command->footer(
      "The session runs in real time: a haptic thread (1 kHz) with the needle, a simulation thread (50 Hz) with the\n"
      "tissue, a thread that factorises. Everything is recorded; afterwards the recording is replayed to check that "
      "it\n"
      "gives the same bits, and the pictures are drawn from what was kept: drawing never disturbs the loops.\n\n"
      "  stylet train liver_biopsy                       you lead the needle: H lists the keys\n"
      "  stylet train liver_biopsy --device hid          a stylus, space mouse or pen; `stylet devices` lists them\n"
      "  stylet train liver_biopsy --device recorded     the scenario's own motion, as a demonstration\n"
      "  stylet train liver_biopsy --device recorded:content/motions/liver_biopsy.json --lockstep\n"
      "  stylet train liver_biopsy --link                3D Slicer connects to localhost:18944\n"
      "  stylet train liver_biopsy --link --device link  and a tracked needle drives the needle\n"
      "  stylet train liver_biopsy --trainee ada         and the lab keeps what came of it; `stylet lab show ada`\n"
      "  stylet train liver_biopsy --ask-trainee         who trains is chosen in the window, as in the menu of "
      "`stylet`\n"
      "In the window: Enter begins and finishes, T fires or heats, X pauses, F7 mutes, Backspace tries again (the "
      "attempt "
      "before\n"
      "is kept in OUT/attempt-N); H lists all keys. Needle and probe stand elsewhere each time, as --seed has them.\n"
      "When it is over the window shows score and advice: Backspace tries again, N goes on to the next scenario (in\n"
      "OUT-2, OUT-3, ...), O opens the debrief, F9 makes the film, Q leaves. A tissue table that is saved meanwhile "
      "shows in the "
      "image.\n"
      "In a headset: the menu button begins and pauses, the right trigger fires or heats, the left one freezes the\n"
      "image, the left stick turns gain and depth, right B or menu holds the breath, A, X or the pad goes through "
      "the panel, the instructor's panel\n"
      "with a transparent patient, and none. --left-handed: the other way round.\n"
      "Ctrl-C ends the session early; what happened until then is kept and drawn.\n"
      "Exit code 0: done; 1: the replay differs; 2: bad input.");
  command->callback([options, &exit_code] {
    const app::TraineeSettings& of = options->session.trainee;
    if (of.name.empty() && !options->ask_trainee && (!of.course.empty() || !of.lab.empty())) {
      throw files::ContentError("--course and --lab are of a trainee's attempts: say whose with --trainee NAME");
    }
    exit_code = options->session.scenario.empty() ? list_scenarios() : run_training(*options);
  });
}

}  // namespace stylet::tools
