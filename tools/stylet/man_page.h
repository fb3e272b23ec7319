// The man page stylet(1), made of what `--help` is made of.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

namespace stylet::tools {

/// @param version  for the foot of the page
/// @return roff of the macro package man
std::string man_page(const CLI::App& app, const std::string& version);

}  // namespace stylet::tools
