// The sub-commands of `stylet`. Each adds itself to the command line and runs when chosen.
#pragma once

#include <CLI/CLI.hpp>

#include <optional>

namespace stylet::tools {

/// What main() returns: 0 done, 1 ran but the answer is no (a replay that differs),
/// 2 bad input or a device that is not there, 130 ended by Ctrl-C (as a shell would say).
inline constexpr int kExitYes = 0;
inline constexpr int kExitNo = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitInterrupted = 130;

/// `stylet` without a command: on a desktop the menu. @return exit code; nothing: there is no desktop
std::optional<int> run_menu();

void add_bench(CLI::App& app, int& exit_code);
void add_train(CLI::App& app, int& exit_code);
void add_render(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_debrief(CLI::App& app, int& exit_code);
void add_import(CLI::App& app, int& exit_code);
void add_author(CLI::App& app, int& exit_code);
void add_validate(CLI::App& app, int& exit_code);
void add_devices(CLI::App& app);
void add_schema(CLI::App& app);
void add_course(CLI::App& app, int& exit_code);
void add_lab(CLI::App& app, int& exit_code);

}  // namespace stylet::tools
