// Completion in a shell: the shell asks `stylet complete` for every word, so that what it offers is what the command
// line takes now, scenarios and benches included.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace stylet::tools {

/// A word that could stand where the user types, and what it means: one line or empty.
struct Completion {
  std::string word;
  std::string meaning;
};

/// @param words  after `stylet`, as bash cuts them (at = and : too) or whole; the last is being typed and may be
/// empty
/// @return none: a file, or something of the user's own
std::vector<Completion> completions(const CLI::App& app, const std::vector<std::string>& words);

/// "word<TAB>meaning" a line.
std::string completion_lines(const std::vector<Completion>& completions);

/// Of bash, zsh or fish: what makes the shell ask. @return empty: another shell
std::string completion_script(const std::string& shell);

}  // namespace stylet::tools
