// `stylet validate`: all problems of a content file at once.
#include "engine/content/scenario.h"
#include "tools/stylet/commands.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace stylet::tools {

void add_validate(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("validate", "Check a scenario, organ, tissue table, needle, probe or motion");
  auto paths = std::make_shared<std::vector<std::string>>();
  command->add_option("PATH", *paths, "Files to check; the kind is read from the file")->required();
  command->footer(
      "Prints every problem, one a line: file, place (JSON pointer or line), what is wrong and what to do.\n"
      "A scenario is checked with every file it names, and its organs are turned into tetrahedra.\n"
      "Exit code 0: sound; 2: problems were found.");
  command->callback([paths, &exit_code] {
    for (const std::string& path : *paths) {
      const std::vector<std::string> problems = content::validate(path);
      for (const std::string& problem : problems) fmt::print("{}\n", problem);
      fmt::print("{}: {}\n", path, problems.empty() ? "sound" : fmt::format("{} problem(s)", problems.size()));
      if (!problems.empty()) exit_code = kExitBadInput;
    }
  });
}

}  // namespace stylet::tools
