// A command line that cannot be read: one line that says which word, and what was meant.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

namespace stylet::tools {

/// @return empty: it is a command, or none is named
std::string no_command(const CLI::App& app, const std::string& first_word);

/// @param error  of app.parse()
std::string refusal(const CLI::App& app, const CLI::ParseError& error);

}  // namespace stylet::tools
