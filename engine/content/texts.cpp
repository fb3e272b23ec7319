#include "engine/content/texts.h"

#include <cctype>
#include <vector>

namespace stylet::content {
namespace {

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

}  // namespace

std::string Texts::of(std::string_view english) const {
  if (texts_.empty() || english.empty()) return std::string(english);
  if (const auto found = texts_.find(english); found != texts_.end()) return found->second;
  const std::size_t dot = english.find(". ");
  if (dot != std::string_view::npos && dot > 0 && dot <= 2 && is_digit(english[0]) && is_digit(english[dot - 1])) {
    return std::string(english.substr(0, dot + 2)) + of(english.substr(dot + 2));
  }
  std::string pattern;
  std::vector<std::string_view> numbers;
  for (std::size_t at = 0; at < english.size();) {
    std::size_t end = at;
    while (end < english.size() &&
           (is_digit(english[end]) ||
            (end > at && english[end] == '.' && end + 1 < english.size() && is_digit(english[end + 1])))) {
      ++end;
    }
    if (end == at) {
      pattern += english[at++];
      continue;
    }
    numbers.push_back(english.substr(at, end - at));
    pattern += "{}";
    at = end;
  }
  const auto found = numbers.empty() ? texts_.end() : texts_.find(pattern);
  if (found == texts_.end()) return std::string(english);
  std::string text = found->second;
  std::size_t at = 0;
  for (const std::string_view number : numbers) {
    at = text.find("{}", at);
    if (at == std::string::npos) break;
    text.replace(at, 2, number);
    at += number.size();
  }
  return text;
}

}  // namespace stylet::content
