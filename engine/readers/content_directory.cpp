// Where content lies, and which scenarios there are.
#include "engine/files/json_reader.h"
#include "engine/readers/scenario.h"
#include "engine/readers/scenario_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>

namespace stylet::readers {

namespace fs = std::filesystem;

fs::path content_directory() {
  std::error_code error;
  if (const char* chosen = std::getenv("STYLET_CONTENT"); chosen != nullptr && *chosen != '\0') {
    if (fs::is_directory(chosen, error)) return chosen;
    throw files::ContentError(fmt::format("STYLET_CONTENT={}: is not a folder; correct or unset it", chosen));
  }
  const fs::path binary = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = (binary.parent_path() / ".." / "share" / "stylet" / "content").lexically_normal();
  if (!error && fs::is_directory(installed, error)) return installed;
  const fs::path source = STYLET_SOURCE_CONTENT;
  if (fs::is_directory(source, error)) return source;
  throw files::ContentError(fmt::format("no content folder: neither {} nor {}; set STYLET_CONTENT to it",
                                        installed.string(), source.string()));
}

namespace {

/// Nothing where the file says that it is of another kind.
std::optional<ScenarioEntry> scenario_entry(const fs::path& path) {
  const std::string stem = path.stem().string();
  try {
    files::JsonFile file(path);
    if (const std::string format = file.format(); !format.empty() && format != scenario_format().id)
      return std::nullopt;
    files::JsonObject root = file.root(scenario_format());
    const ScenarioTitle title = read_scenario_title(root);
    file.throw_problems();
    return ScenarioEntry{path, title.name, title.title, {}};
  } catch (const files::ContentError& error) {
    return ScenarioEntry{path, stem, stem, error.what()};
  }
}

}  // namespace

std::vector<ScenarioEntry> list_scenarios(const fs::path& folder) {
  std::vector<ScenarioEntry> entries;
  std::error_code error;
  for (const auto& file : fs::directory_iterator(folder, error)) {
    if (file.path().extension() != ".json") continue;
    if (auto entry = scenario_entry(file.path())) entries.push_back(std::move(*entry));
  }
  std::sort(entries.begin(), entries.end(),
            [](const ScenarioEntry& a, const ScenarioEntry& b) { return a.path < b.path; });
  return entries;
}

fs::path find_scenario(const std::string& path_or_name) {
  std::error_code error;
  if (fs::is_regular_file(path_or_name, error)) return path_or_name;
  const auto entries = list_scenarios(content_directory() / "scenarios");
  std::set<std::string> names;
  // The file of that name before another file's word for itself.
  for (const ScenarioEntry& entry : entries) {
    if (entry.path.stem() == path_or_name) return entry.path;
  }
  for (const ScenarioEntry& entry : entries) {
    if (entry.name == path_or_name) return entry.path;
    if (entry.unreadable_because.empty()) names.insert(entry.name);
  }
  const std::string close = files::nearest(path_or_name, names);
  throw files::ContentError(fmt::format(
      "{}: there is no such file or scenario; {}: {}", path_or_name,
      close.empty() ? "name one of" : fmt::format("did you mean {}? There are", close), fmt::join(names, ", ")));
}

}  // namespace stylet::readers
