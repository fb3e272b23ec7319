#include "engine/author/json_edit.h"

#include "engine/files/error.h"

#include <nlohmann/json.hpp>

#include <charconv>
#include <cstddef>
#include <optional>

namespace stylet::author {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

[[noreturn]] void refuse(const JsonPath& path) {
  std::string place;
  for (const std::string& step : path) place += "/" + step;
  throw files::ContentError(place + ": what it leads through is not there, so nothing can be put there");
}

std::size_t past_space(std::string_view text, std::size_t at) {
  at = text.find_first_not_of(kSpace, at);
  return at == std::string_view::npos ? text.size() : at;
}

std::size_t past_string(std::string_view text, std::size_t at) {
  for (++at; at < text.size() && text[at] != '"'; ++at) {
    if (text[at] == '\\') ++at;
  }
  return std::min(at + 1, text.size());
}

/// Behind the value that begins there. The text has been parsed: it is JSON.
std::size_t past_value(std::string_view text, std::size_t at) {
  if (text[at] == '"') return past_string(text, at);
  if (text[at] != '{' && text[at] != '[') return text.find_first_of(std::string(kSpace) + ",]}", at);
  int depth = 0;
  while (at < text.size()) {
    if (text[at] == '"') {
      at = past_string(text, at);
      continue;
    }
    if (text[at] == '{' || text[at] == '[') ++depth;
    if (text[at] == '}' || text[at] == ']') --depth;
    ++at;
    if (depth == 0) break;
  }
  return at;
}

struct Entry {
  std::size_t begin = 0;  ///< of its key, where it has one
  std::size_t value = 0;
  std::size_t end = 0;
  std::string key{};
};

struct Container {
  bool object = false;
  std::size_t open = 0;   ///< its bracket
  std::size_t close = 0;  ///< the other one
  std::vector<Entry> entries{};
};

std::optional<Container> container_at(std::string_view text, std::size_t at) {
  if (at >= text.size() || (text[at] != '{' && text[at] != '[')) return std::nullopt;
  Container out{.object = text[at] == '{', .open = at, .close = past_value(text, at) - 1};
  for (at = past_space(text, at + 1); at < out.close;) {
    Entry entry{.begin = at, .value = at};
    if (out.object) {
      const std::size_t end = past_string(text, at);
      entry.key = nlohmann::json::parse(text.substr(at, end - at)).get<std::string>();
      entry.value = past_space(text, past_space(text, end) + 1);  // a colon
    } else {
      entry.key = std::to_string(out.entries.size());
    }
    entry.end = past_value(text, entry.value);
    out.entries.push_back(entry);
    at = past_space(text, entry.end);
    if (at < out.close) at = past_space(text, at + 1);  // a comma
  }
  return out;
}

struct Place {
  Container in{};
  std::optional<std::size_t> entry{};
};

Place find(std::string_view text, const JsonPath& path) {
  if (path.empty() || !nlohmann::json::accept(text)) refuse(path);
  std::size_t at = past_space(text, 0);
  for (std::size_t i = 0;; ++i) {
    const auto container = container_at(text, at);
    if (!container) refuse(path);
    Place place{.in = *container, .entry = {}};
    for (std::size_t k = 0; k < container->entries.size(); ++k) {
      if (container->entries[k].key == path[i]) place.entry = k;
    }
    if (i + 1 == path.size()) return place;
    if (!place.entry) refuse(path);
    at = container->entries[*place.entry].value;
  }
}

}  // namespace

std::string with_value(std::string_view text, const JsonPath& path, std::string_view value) {
  const Place place = find(text, path);
  std::string out(text);
  if (place.entry) {
    const Entry& entry = place.in.entries[*place.entry];
    const std::string_view before = text.substr(entry.value, entry.end - entry.value);
    if (nlohmann::json::parse(before) == nlohmann::json::parse(value)) return out;
    return out.replace(entry.value, before.size(), value);
  }
  std::string entry(value);
  if (place.in.object) entry = nlohmann::json(path.back()).dump() + ": " + entry;
  if (place.in.entries.empty()) return out.replace(place.in.open + 1, place.in.close - place.in.open - 1, entry);
  // As those before it are set apart.
  const Entry& first = place.in.entries.front();
  const Entry& last = place.in.entries.back();
  const std::string space(text.substr(place.in.open + 1, first.begin - place.in.open - 1));
  return out.insert(last.end, "," + (space.find('\n') == std::string::npos ? " " : space) + entry);
}

std::string without_value(std::string_view text, const JsonPath& path) {
  const Place place = find(text, path);
  std::string out(text);
  if (!place.entry) return out;
  const std::vector<Entry>& entries = place.in.entries;
  const std::size_t at = *place.entry;
  if (entries.size() == 1) return out.erase(place.in.open + 1, place.in.close - place.in.open - 1);
  if (at + 1 < entries.size()) return out.erase(entries[at].begin, entries[at + 1].begin - entries[at].begin);
  return out.erase(entries[at - 1].end, entries[at].end - entries[at - 1].end);
}

}  // namespace stylet::author
