// `stylet replay`: runs a recording again and says whether every bit is the same; shows it, makes a film of it.
#include "engine/debrief/debrief.h"
#include "engine/debrief/film.h"
#include "engine/debrief/session_replay.h"
#include "engine/debrief/still_moment.h"
#include "engine/desktop/replay_keys.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/recorded_session.h"
#include "tools/stylet/replay_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

namespace stylet::tools {

namespace {

struct ReplayOptions {
  std::string recording;
  std::string scenario;
  std::string out;
  std::string view = "none";
  std::string gpu;
  double from_s = 0;
  double to_s = std::numeric_limits<double>::infinity();
  double speed = 1;
};

/// The span of the session that is drawn, which has something in it.
void check_span(const ReplayOptions& options, double duration_s) {
  if (options.from_s < options.to_s && options.from_s < duration_s) return;
  throw files::ContentError(fmt::format("--from {:g} --to {:g}: the span must lie within the session, 0 to {:.2f} s",
                                        options.from_s, options.to_s, duration_s));
}

/// Film, stills and force of the replayed session.
void write_export(const ReplayOptions& options, const content::Scene& scene, const recording::Recording& recording,
                  debrief::SessionReplay& replay, Progress& progress) {
  gpu::Device gpu({.gpu = options.gpu});
  files::OutputDirectory out(options.out);
  debrief::write_force(out, recording, replay.force());
  const debrief::FilmSettings film{.from_s = options.from_s, .to_s = options.to_s, .speed = options.speed};
  const int count = debrief::write_film(out, scene, gpu, replay, replay.force(), film, [&](double share) {
    throw_if_interrupted();
    progress.show("Drawing the video", share);
  });
  const debrief::StillMoment moment =
      debrief::still_moment(recording.events, replay.frames(), options.from_s, options.to_s);
  debrief::write_stills(out, scene, gpu, replay, moment.time_s, replay.force(), {.film = film});
  out.commit();
  progress.done();
  fmt::print("{}: session.mp4 ({} frames), session.png, view.png and ultrasound.png {}, force.png, force.csv\n",
             out.destination().string(), count, moment.words);
}

/// @return exit code
int tell_result(const debrief::SessionReplay& replay, const recording::Recording& recording) {
  const session::ReplayResult& result = replay.result();
  fmt::print("{} haptic and {} simulation steps in {:.1f} s ({:.1f} s of session); haptic step median {:.0f} us\n",
             result.run.haptic.steps, result.run.simulation.steps, result.run.wall_s, result.run.duration_s,
             result.run.haptic.step_time.median_s * 1e6);
  fmt::print("state hash {}\n", session::hash_text(replay.state_hash()));
  if (result.divergence) {
    fmt::print("DIFFERS: first at {} step {}: recorded {}, replayed {}\n",
               result.divergence->loop == recording::LoopName::haptic ? "haptic" : "simulation",
               result.divergence->step, session::hash_text(result.divergence->recorded),
               session::hash_text(result.divergence->replayed));
    fmt::print("The same bits need the same binary, libraries and kind of CPU; recorded by {}\n",
               recording.header.build);
    return kExitNo;
  }
  if (result.compared == 0) {
    fmt::print("The recording holds no hashes to compare with\n");
    return kExitNo;
  }
  fmt::print("identical: {} hashes compared\n", result.compared);
  return kExitYes;
}

int replay_recording(const ReplayOptions& options) {
  Progress progress;
  const RecordedSession session = open_recording(options.recording, options.scenario, progress);
  const auto& [recording, steps, scene] = session;
  const double duration_s = session.duration_s();
  check_span(options, duration_s);
  debrief::SessionReplay replay(scene, recording);
  if (options.view == "window") {
    view::Display display;
    gpu::Device gpu({.gpu = options.gpu, .window_extensions = display.vulkan_extensions()});
    fmt::print("{}\n", desktop::kReplayKeys);
    show_replay(display, gpu, scene, replay,
                debrief::Playback(options.from_s, std::min(options.to_s, duration_s), options.speed));
    if (replay.result().run.haptic.steps < steps.haptic) return kExitYes;  // closed before the end
  } else {
    replay.run([&](double share) {
      throw_if_interrupted();
      progress.show("Replaying", share);
    });
  }
  progress.done();
  fmt::print("{}", training::in_words(training::assess(replay.trace(), scene)));
  const int exit_code = tell_result(replay, recording);
  if (!options.out.empty()) write_export(options, scene, recording, replay, progress);
  return exit_code;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("replay", "Run a recording again, compare every state hash, show it, make a film of it");
  auto options = std::make_shared<ReplayOptions>();
  command
      ->add_option("RECORDING", options->recording,
                   "A session.rec that `stylet train` wrote, an unfinished-*.rec that a crash left, or their folder")
      ->required();
  command->add_option("--scenario", options->scenario, "Scenario to use instead of the one named in the recording");
  command->add_option("--out", options->out, "Folder for session.mp4, pictures and force; default: none are made");
  command->add_option("--from", options->from_s, "Start of film and window, s of the session")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--to", options->to_s, "End of film and window, s; default: the end of the session")
      ->check(CLI::PositiveNumber);
  command->add_option("--speed", options->speed, "Of film and window: 0.25 is slow motion, 4 is fast")
      ->check(CLI::Range(debrief::Playback::kSlowest, debrief::Playback::kFastest))
      ->capture_default_str();
  command->add_option("--view", options->view, "window: watch it")
      ->check(CLI::IsMember({"none", "window"}))
      ->capture_default_str();
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  command->footer(fmt::format(
      "A recording holds the input of every step of both loops and what each consumed (needle state, tissue patch,\n"
      "factorisation), so a threaded session is repeated on its own schedule in one thread. The physics always runs\n"
      "from the start, since every state follows from the one before; --from and --to choose what is drawn.\n"
      "A session that was killed leaves its recording as unfinished-*.rec in its folder, whole but for the last\n"
      "second; it replays up to there.\n\n"
      "  stylet replay out/demo --out out/film --from 8 --to 10 --speed 0.25\n"
      "  stylet replay out/demo --view window\n\n"
      "Keys of the window: {}.\n"
      "Exit code 0: bit for bit the same; 1: it differs; 2: bad input.",
      desktop::kReplayKeys));
  command->callback([options, &exit_code] { exit_code = replay_recording(*options); });
}

}  // namespace stylet::tools
