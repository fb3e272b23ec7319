// A scenario file on disk becomes a Scene in memory: the one entry to everything a session needs.
#pragma once

#include "engine/content/scene.h"
#include "engine/files/error.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::readers {

/// Called while a scene loads: what is being done, and the share already done in [0, 1]. Same thread as load_scene().
using LoadProgress = std::function<void(const std::string& doing, double share)>;

/// Reads a scenario and every file it names, tetrahedralises the deformable bodies, embeds the surfaces and voxelises
/// the labels. Deterministic: the same files give the same bits.
/// @param warnings  appended to: what is odd but no reason to refuse, one line each, "file:place: what"
/// @throws ContentError  the first problem as one line; nothing half-loaded comes out
content::Scene load_scene(const std::filesystem::path& scenario, const LoadProgress& progress = {},
                          std::vector<std::string>* warnings = nullptr);

/// The "format" key of a JSON file, empty where it has none. @throws ContentError  unreadable
std::string format_of(const std::filesystem::path& path);

/// Whether validate() knows the "format".
bool is_content_format(std::string_view format);

/// All problems of a content file at once, one line each; empty: it is sound. The kind of file is taken from its
/// "format" key, or from its bytes for glTF. A scenario is checked with every file it names, and its organs are
/// tetrahedralised. Never throws for what the file does wrong.
/// @param scene  filled where the file is a sound scenario
/// @param warnings  appended to, as by load_scene()
std::vector<std::string> validate(const std::filesystem::path& path, std::optional<content::Scene>* scene = nullptr,
                                  std::vector<std::string>* warnings = nullptr);

/// A *.json of a folder that is a scenario, or was to be one.
struct ScenarioEntry {
  std::filesystem::path path;
  std::string name;                ///< the file's, without .json, where it is unreadable
  std::string title;               ///< one line for people
  std::string unreadable_because;  ///< one line, "file:place: what is wrong"; empty: it can be read
};

/// The scenarios of a folder, by file name. Files that say they are another kind ("format") are left out; those that
/// cannot be read are listed with the cause.
std::vector<ScenarioEntry> list_scenarios(const std::filesystem::path& folder);

/// The folder with organs, scenarios, tissues, ...: the environment variable STYLET_CONTENT, else
/// ../share/stylet/content next to the running binary, else the source tree it was built from.
/// @throws ContentError  none of them is a folder
std::filesystem::path content_directory();

/// A scenario as a user names it: a path to a file, or the name of one in content_directory()/scenarios. A file that
/// cannot be read is found too: reading it says what is wrong.
/// @throws ContentError  there is neither; the message lists the names there are
std::filesystem::path find_scenario(const std::string& path_or_name);

}  // namespace stylet::readers
