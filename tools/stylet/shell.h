// What the shell and the packager ask of the command; not in its help.
#pragma once

#include <CLI/CLI.hpp>

namespace stylet::tools {

/// `stylet completion SHELL` and `stylet man`, made of the commands that `app` has then.
void add_shell(CLI::App& app);

/// `stylet complete -- WORD...`: prints what could stand for the last word. The words are taken as they are, whatever
/// CLI11 would make of them. @return false: something else was asked
bool complete(const CLI::App& app, int argc, char** argv);

}  // namespace stylet::tools
