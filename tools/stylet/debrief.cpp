// `stylet debrief`: the debrief of a recording written again, with another expert or after a crash.
#include "engine/app/debrief_recording.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <memory>

namespace stylet::tools {

namespace {

int run(const app::DebriefRecordingSettings& settings) {
  Terminal terminal;
  const app::DebriefedRecording done = app::debrief_recording(settings, terminal);
  fmt::print("{}: debrief.html, debrief.json, debrief.csv, path.csv\n", done.folder.string());
  if (done.identical) return kExitYes;
  fmt::print(stderr, "stylet: the replay differs from the session: its numbers may too\n");
  return kExitNo;
}

}  // namespace

void add_debrief(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("debrief", "Write the debrief of a recording: page, JSON, CSV");
  auto options = std::make_shared<app::DebriefRecordingSettings>();
  command
      ->add_option("RECORDING", options->recording,
                   "A session.rec that `stylet train` wrote, an unfinished-*.rec that a crash left, or their folder")
      ->required();
  command->add_option("--scenario", options->scenario, "Scenario to use instead of the one named in the recording");
  command->add_option("--expert", options->expert, kExpertHelp);
  command->add_option("--out", options->out, "Folder for the results")->capture_default_str();
  command->add_option("--gpu", options->gpu, "GPU by a part of its name or its number");
  command->footer(
      "debrief.html is one file that opens in any browser, without network: score, course, forces, the needle's way\n"
      "in 3-D, ultrasound at the key moments, next to an expert's. The same numbers are in debrief.json and the "
      "CSV.\n\n"
      "  stylet debrief out/demo --out out/debrief\n"
      "  stylet debrief out/trainee --expert out/teacher/session.rec --out out/compared\n\n"
      "Exit code 0: done; 1: the replay differs; 2: bad input.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace stylet::tools
