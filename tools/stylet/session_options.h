// Options that several commands have.
#pragma once

#include "engine/app/link_session.h"
#include "engine/app/load_scene.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace stylet::tools {

/// Of --device. @param otherwise  which stylus leads where none is named
std::string device_help(const std::string& otherwise);

inline constexpr const char* kCouplingHelp =
    "stylet; the paper's, with directions normal to the needle's edges (paper-updated) or to the line of the contact "
    "points (paper-trajectory, III-C); or paper-frozen; default: the scenario's";
inline constexpr const char* kExpertHelp =
    "Whom the debrief compares with: another recording of the scenario, or none; default: the scenario's motion";

inline constexpr const char* kLabHelp =
    "Folder of the lab's records; default: STYLET_LAB, else stylet/lab in XDG_DATA_HOME or ~/.local/share";

inline const CLI::IsMember kCouplings({"stylet", "paper-updated", "paper-trajectory", "paper-frozen"});

/// A time above 0, in seconds, that ends.
CLI::Validator seconds_above_zero();

void add_scanner_options(CLI::App& command, app::ScannerSettings& settings);

struct LinkOptions {
  std::vector<std::string> port{};  ///< of --link: at most one
  bool serve = false;               ///< --link was said
  std::string address = "127.0.0.1";
  std::string from{};
  double image_hz = 20;
  double transform_hz = 50;
};
void add_link_options(CLI::App& command, LinkOptions& options);
/// @throws link::LinkError  no port, no HOST:PORT
app::SessionLinkSettings link_settings(const LinkOptions& options);

}  // namespace stylet::tools
