// `stylet replay`: runs a recording again and says whether every bit is the same.
#include "engine/session/replay.h"
#include "engine/content/scenario.h"
#include "engine/session/session_report.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace stylet::tools {

namespace {

int replay_recording(const std::string& path, const std::string& scenario) {
  const session::Recording recording = session::read_recording(path);
  fmt::print("{}: {}\n", path, recording.condition());
  const session::RecordedSettings settings = session::recorded_settings(recording);
  const auto scenario_path = content::find_scenario(scenario.empty() ? recording.header.scenario : scenario);
  if (session::file_hash(scenario_path) != recording.header.scenario_hash) {
    fmt::print(stderr, "stylet: {} has changed since the recording was made; the replay may differ\n",
               scenario_path.string());
  }
  Progress progress;
  content::Scene scene = load_scene(scenario_path.string(), progress);
  if (settings.haptic_hz > 0) set_haptic_rate(scene, settings.haptic_hz);
  session::StepHash hash;
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  const session::ReplayResult result = session::replay(recording, loops, hash, [&](double share) {
    throw_if_interrupted();
    progress.show("Replaying", share);
  });
  progress.done();
  fmt::print("{} haptic and {} simulation steps in {:.1f} s ({:.1f} s of session); haptic step median {:.0f} us\n",
             result.run.haptic.steps, result.run.simulation.steps, result.run.wall_s, result.run.duration_s,
             result.run.haptic.step_time.median_s * 1e6);
  fmt::print("state hash {}\n", session::hash_text(hash.state()));
  if (result.divergence) {
    fmt::print("DIFFERS: first at {} step {}: recorded {}, replayed {}\n",
               result.divergence->loop == session::LoopName::haptic ? "haptic" : "simulation",
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

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("replay", "Run a recording again and compare every state hash");
  struct Options {
    std::string recording;
    std::string scenario;
  };
  auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recording, "A session.rec that `stylet train` wrote")->required();
  command->add_option("--scenario", options->scenario, "Scenario to use instead of the one named in the recording");
  command->footer(
      "A recording holds the input of every step of both loops and what each consumed (needle state, tissue patch,\n"
      "factorisation), so a threaded session is repeated on its own schedule in one thread.\n"
      "Exit code 0: bit for bit the same; 1: it differs.");
  command->callback([options, &exit_code] { exit_code = replay_recording(options->recording, options->scenario); });
}

}  // namespace stylet::tools
