#include "engine/readers/texts_file.h"

#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <map>

namespace stylet::readers {

content::Texts read_texts(const std::filesystem::path& path) {
  files::JsonFile file(path);
  file.root("stylet-texts", 1);
  std::map<std::string, std::string, std::less<>> texts;
  const auto entries = file.tree().find("texts");
  if (entries == file.tree().end() || !entries->is_object()) {
    throw files::ContentError(path.string() + ":/texts: must be an object, English to the other language");
  }
  for (const auto& [english, other] : entries->items()) {
    if (!other.is_string()) throw files::ContentError(path.string() + ":/texts/" + english + ": must be a text");
    texts.emplace(english, other.get<std::string>());
  }
  return content::Texts(std::move(texts));
}

std::vector<std::string> languages() {
  std::vector<std::string> found{"en"};
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(content_directory() / "texts", error)) {
    if (entry.path().extension() == ".json") found.push_back(entry.path().stem().string());
  }
  std::ranges::sort(found);
  return found;
}

std::string language_name(const std::string& language) {
  if (language == "en") return "English";
  files::JsonFile file(content_directory() / "texts" / (language + ".json"));
  return file.root("stylet-texts", 1).text("language", language);
}

std::string language_of_environment() {
  const std::vector<std::string> there = languages();
  for (const char* variable : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* value = std::getenv(variable);
    if (value == nullptr || *value == '\0') continue;
    const std::string wanted = std::string(value).substr(0, 2);
    return std::ranges::find(there, wanted) != there.end() ? wanted : "en";
  }
  return "en";
}

content::Texts find_texts(const std::string& language) {
  const std::string wanted = language.empty() ? language_of_environment() : language;
  if (wanted == "en") return {};
  const std::vector<std::string> there = languages();
  if (std::ranges::find(there, wanted) == there.end()) {
    throw files::ContentError(
        fmt::format("--language {}: there are no texts for it; say one of {}", wanted, fmt::join(there, ", ")));
  }
  return read_texts(content_directory() / "texts" / (wanted + ".json"));
}

}  // namespace stylet::readers
