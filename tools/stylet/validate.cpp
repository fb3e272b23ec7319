// `stylet validate`: all problems of files at once.
#include "engine/app/validate.h"

#include "engine/files/json_scan.h"
#include "tools/reference/reference_insertion.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace stylet::tools {

namespace {

/// What benches and tests read.
const app::OtherFormats kOtherFormats{{"stylet-reference-insertion", [](const std::filesystem::path& file) {
                                         (void)reference::read_reference_insertion(file);
                                       }}};

/// @return exit code
int validate(const std::vector<std::string>& paths) {
  int exit_code = kExitYes;
  Terminal terminal;
  for (const std::string& path : paths) {
    for (const std::filesystem::path& file : app::files_to_validate(path, kOtherFormats)) {
      const app::Verdict verdict = app::validate(file, kOtherFormats);
      for (const std::string& warning : verdict.warnings) terminal.note(app::Note::warning, warning);
      for (const std::string& problem : verdict.problems) fmt::print("{}\n", files::one_line(problem));
      fmt::print("{}: {}\n", file.string(),
                 verdict.sound() ? "sound" : fmt::format("{} problem(s)", verdict.problems.size()));
      if (verdict.sound()) fmt::print("{}", verdict.summary);
      if (!verdict.sound()) exit_code = kExitBadInput;
    }
  }
  return exit_code;
}

}  // namespace

void add_validate(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "validate", "Check scenarios, courses, organs, tissue tables, needles, probes, motions, recordings");
  auto paths = std::make_shared<std::vector<std::string>>();
  command->add_option("PATH", *paths, "Files, or folders of them; the kind is read from the file")->required();
  command->footer(
      "Prints every problem, one a line: file, place (JSON pointer or line), what is wrong and what to do.\n"
      "A scenario is checked with every file it names, and its organs are turned into tetrahedra; a sound one is\n"
      "summed up: nodes, tetrahedra, volumes; of a course the gates, with what each is worth. Of a folder, every "
      "*.glb, *.gltf, *.rec and content file (*.json)\n"
      "below it is checked.\n"
      "Exit code 0: sound; 2: problems were found.");
  command->callback([paths, &exit_code] { exit_code = validate(*paths); });
}

}  // namespace stylet::tools
