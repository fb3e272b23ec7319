// Where content lies, and which scenarios there are.
#include "engine/content/json_reader.h"
#include "engine/content/scenario.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>

namespace stylet::content {

namespace fs = std::filesystem;

fs::path content_directory() {
  std::error_code error;
  if (const char* chosen = std::getenv("STYLET_CONTENT"); chosen != nullptr && *chosen != '\0') {
    if (fs::is_directory(chosen, error)) return chosen;
    throw ContentError(fmt::format("STYLET_CONTENT={}: is not a folder; correct or unset it", chosen));
  }
  const fs::path binary = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = (binary.parent_path() / ".." / "share" / "stylet" / "content").lexically_normal();
  if (!error && fs::is_directory(installed, error)) return installed;
  const fs::path source = STYLET_SOURCE_CONTENT;
  if (fs::is_directory(source, error)) return source;
  throw ContentError(fmt::format("no content folder: neither {} nor {}; set STYLET_CONTENT to it", installed.string(),
                                 source.string()));
}

std::vector<ScenarioEntry> list_scenarios(const fs::path& folder) {
  std::vector<ScenarioEntry> entries;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".json") continue;
    try {
      JsonFile file(entry.path());
      JsonObject root = file.root("stylet-scenario", 1);
      const std::string name = root.text("name");
      entries.push_back({entry.path(), name, root.text("title", name)});
      if (!file.problems().empty()) entries.pop_back();
    } catch (const ContentError&) {
      continue;  // `validate` says what is wrong with it
    }
  }
  std::sort(entries.begin(), entries.end(),
            [](const ScenarioEntry& a, const ScenarioEntry& b) { return a.path < b.path; });
  return entries;
}

fs::path find_scenario(const std::string& path_or_name) {
  std::error_code error;
  if (fs::is_regular_file(path_or_name, error)) return path_or_name;
  const auto entries = list_scenarios(content_directory() / "scenarios");
  std::vector<std::string> names;
  for (const ScenarioEntry& entry : entries) {
    if (entry.name == path_or_name || entry.path.stem() == path_or_name) return entry.path;
    names.push_back(entry.name);
  }
  throw ContentError(
      fmt::format("{}: there is no such file or scenario; name one of: {}", path_or_name, fmt::join(names, ", ")));
}

}  // namespace stylet::content
