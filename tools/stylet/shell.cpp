#include "tools/stylet/shell.h"

#include "engine/app/build_name.h"
#include "tools/stylet/completion.h"
#include "tools/stylet/man_page.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::tools {

namespace {
constexpr const char* kHidden = "";  // a group that the help leaves out
}

void add_shell(CLI::App& app) {
  CLI::App* command = app.add_subcommand("completion", "What makes a shell complete stylet's words")->group(kHidden);
  auto shell = std::make_shared<std::string>();
  command->add_option("SHELL", *shell, "Which shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->footer(
      "`cmake --install` puts it where the shell looks. By hand:\n\n"
      "  source <(stylet completion bash)");
  command->callback([shell] { std::fputs(completion_script(*shell).c_str(), stdout); });
  app.add_subcommand("man", "The man page")->group(kHidden)->callback([&app] {
    std::fputs(man_page(app, app::build_name()).c_str(), stdout);
  });
}

bool complete(const CLI::App& app, int argc, char** argv) {
  if (argc < 3 || std::string_view(argv[1]) != "complete" || std::string_view(argv[2]) != "--") return false;
  const std::vector<std::string> words(argv + 3, argv + argc);
  std::fputs(completion_lines(completions(app, words)).c_str(), stdout);
  return true;
}

}  // namespace stylet::tools
