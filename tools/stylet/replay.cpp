// `stylet replay`: runs a recording again and says whether every bit is the same; shows it, makes a film of it.
#include "engine/app/replay.h"
#include "engine/app/replay_window.h"
#include "engine/desktop/replay_keys.h"
#include "engine/session/session_report.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace stylet::tools {

namespace {

struct ReplayOptions {
  app::ReplaySettings replay{};
  std::string view = "none";
  std::string out{};
};

/// @return exit code
int print_result(const app::Replay& replay) {
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
               replay.recording().header.build);
    return kExitNo;
  }
  if (result.compared == 0) {
    fmt::print("The recording holds no hashes to compare with\n");
    return kExitNo;
  }
  fmt::print("identical: {} hashes compared\n", result.compared);
  return kExitYes;
}

int run(const ReplayOptions& options) {
  app::ReplaySettings settings = options.replay;
  settings.window = options.view == "window";
  Terminal terminal;
  app::Replay replay(settings, terminal);
  if (!replay.run()) return kExitYes;
  fmt::print("{}", training::in_words(replay.training()));
  const int exit_code = print_result(replay);
  if (options.out.empty()) return exit_code;
  const app::ReplayFilm film = replay.write_film(options.out);
  fmt::print("{}: session.mp4 ({} frames), session.png, view.png and ultrasound.png {}, force.png, force.csv\n",
             film.folder.string(), film.frames, film.still_moment);
  return exit_code;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("replay", "Run a recording again, compare every state hash, show it, make a film of it");
  auto options = std::make_shared<ReplayOptions>();
  command
      ->add_option("RECORDING", options->replay.recording,
                   "A session.rec that `stylet train` wrote, an unfinished-*.rec that a crash left, or their folder")
      ->required();
  command->add_option("--scenario", options->replay.scenario,
                      "Scenario to use instead of the one named in the recording");
  command->add_option("--out", options->out, "Folder for session.mp4, pictures and force; default: none are made");
  command->add_option("--from", options->replay.from_s, "Start of film and window, s of the session")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--to", options->replay.to_s, "End of film and window, s; default: the end of the session")
      ->check(seconds_above_zero());
  command->add_option("--speed", options->replay.speed, "Of film and window: 0.25 is slow motion, 4 is fast")
      ->check(CLI::Range(debrief::Playback::kSlowest, debrief::Playback::kFastest))
      ->capture_default_str();
  command->add_option("--view", options->view, "window: watch it")
      ->check(CLI::IsMember({"none", "window"}))
      ->capture_default_str();
  command->add_option("--gpu", options->replay.gpu, "GPU by a part of its name or its number");
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
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace stylet::tools
