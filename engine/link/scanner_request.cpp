#include "engine/link/scanner_request.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

namespace stylet::link {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

/// Takes the first word off `text`.
std::string_view next_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(kSpace));
  text.remove_prefix(word.size());
  return word;
}

/// Value of an attribute in what stands between < and >. Nothing: it is not there.
std::optional<std::string_view> attribute(std::string_view element, std::string_view name) {
  for (std::size_t at = element.find(name); at != std::string_view::npos; at = element.find(name, at + 1)) {
    if (at == 0 || kSpace.find(element[at - 1]) == std::string_view::npos) continue;
    const std::string_view rest = trimmed(element.substr(at + name.size()));
    if (rest.empty() || rest.front() != '=') continue;
    const std::string_view quoted = trimmed(rest.substr(1));
    if (quoted.empty() || (quoted.front() != '"' && quoted.front() != '\'')) continue;
    const std::size_t end = quoted.find(quoted.front(), 1);
    if (end == std::string_view::npos) return std::nullopt;
    return trimmed(quoted.substr(1, end - 1));
  }
  return std::nullopt;
}

ScannerRequest refused(std::string problem) {
  return {.problem = std::move(problem)};
}

bool add(ScannerRequest& request, std::string_view name, std::string value) {
  if (name.empty() || name.size() > kLongestWord || value.size() > kLongestWord ||
      request.settings.size() == kMostSettings) {
    return false;
  }
  request.settings.push_back({std::string(name), std::move(value)});
  return true;
}

/// Element by element; nesting, comments and entities mean nothing here.
ScannerRequest read_plus(std::string_view text) {
  ScannerRequest request;
  bool command = false;
  for (std::size_t open = text.find('<'); open != std::string_view::npos; open = text.find('<', open + 1)) {
    const std::size_t close = text.find('>', open);
    if (close == std::string_view::npos) return refused("an element without its end");
    std::string_view element = text.substr(open + 1, close - open - 1);
    const std::string_view whole = element;
    const std::string_view tag = next_word(element);
    if (tag == "Command") {
      if (attribute(whole, "Name") != "SetUsParameter") return refused("the one command is SetUsParameter");
      command = true;
    } else if (tag == "Parameter") {
      const auto name = attribute(whole, "Name"), value = attribute(whole, "Value");
      if (!name || !value) return refused("a Parameter without Name or Value");
      if (!add(request, *name, fmt::format("={}", *value))) return refused("a Parameter too long, or too many");
    }
  }
  if (!command || request.settings.empty()) return refused("a SetUsParameter without a Parameter");
  return request;
}

ScannerRequest read_words(std::string_view text) {
  if (next_word(text) != "scanner") return refused("write such as: scanner gain +2");
  ScannerRequest request;
  const std::string_view name = next_word(text);
  const std::string_view value = next_word(text);
  if (!trimmed(text).empty()) return refused("one knob and one value at a time: scanner gain +2");
  if (!add(request, name, std::string(value))) return refused("write such as: scanner gain +2");
  return request;
}

}  // namespace

ScannerRequest read_scanner_request(std::string_view text) {
  text = trimmed(text.substr(0, text.find('\0')));
  return text.starts_with('<') ? read_plus(text) : read_words(text);
}

}  // namespace stylet::link
