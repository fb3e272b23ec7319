#include "engine/files/json_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <vector>

namespace stylet::files {
namespace {

struct Level {
  bool object = false;
  bool expects_key = false;
  std::set<std::string_view> keys;
};

}  // namespace

std::string printable(std::string text, std::size_t bytes) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = '?';
  }
  if (text.size() > bytes) text = text.substr(0, bytes - 3) + "...";
  return text;
}

std::optional<JsonScanFinding> scan_json(std::string_view text, const JsonLimits& limits) {
  std::vector<Level> levels;
  std::size_t values = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((c == ',' || c == '{' || c == '[') && ++values > limits.values) {
      return JsonScanFinding{i, fmt::format("has more than {} values; split the file", limits.values)};
    }
    if (c == '"') {
      const std::size_t begin = i + 1;
      for (++i; i < text.size() && text[i] != '"'; ++i) {
        if (text[i] == '\\') ++i;
      }
      if (i >= text.size()) return std::nullopt;  // unterminated: the parser says where
      if (levels.empty() || !levels.back().expects_key) continue;
      levels.back().expects_key = false;
      const std::string_view key = text.substr(begin, i - begin);
      if (!limits.duplicate_keys && !levels.back().keys.insert(key).second) {
        return JsonScanFinding{
            begin - 1, fmt::format("key \"{}\" appears twice in one object; keep one", printable(std::string(key)))};
      }
    } else if (c == '{' || c == '[') {
      if (static_cast<int>(levels.size()) >= limits.depth) {
        return JsonScanFinding{i, fmt::format("nested deeper than {} levels; flatten it", limits.depth)};
      }
      levels.push_back({.object = c == '{', .expects_key = c == '{', .keys = {}});
    } else if (c == '}' || c == ']') {
      if (!levels.empty()) levels.pop_back();
    } else if (c == ',') {
      if (!levels.empty()) levels.back().expects_key = levels.back().object;
    } else if (c == 'N' || c == 'n' || c == 'I' || c == 'i') {
      // What other programs write for numbers that JSON has no word for.
      for (const std::string_view word : {"NaN", "nan", "Infinity", "infinity", "Inf", "inf"}) {
        if (text.substr(i).starts_with(word)) {
          return JsonScanFinding{i, fmt::format("{} is no number in JSON; write a finite number", word)};
        }
      }
    } else if (c == '-' || (c >= '0' && c <= '9')) {
      std::size_t end = i + 1;
      while (end < text.size() && std::string_view("0123456789+-.eE").find(text[end]) != std::string_view::npos)
        ++end;
      double value = 0;
      const auto [stop, error] = std::from_chars(text.data() + i, text.data() + end, value);
      // from_chars reports underflow the same way; only a positive exponent can overflow.
      const std::string_view number = text.substr(i, end - i);
      const std::size_t exponent = number.find_first_of("eE");
      const bool tiny =
          exponent != std::string_view::npos && exponent + 1 < number.size() && number[exponent + 1] == '-';
      if (error == std::errc::result_out_of_range && !tiny) {
        return JsonScanFinding{
            i, fmt::format("number {} does not fit a double; write a finite number", number.substr(0, 40))};
      }
      i = end - 1;
    }
  }
  return std::nullopt;
}

std::string line_and_column(std::string_view text, std::size_t offset) {
  offset = std::min(offset, text.size());
  const std::string_view before = text.substr(0, offset);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t start = before.rfind('\n');
  const std::size_t column = start == std::string_view::npos ? offset + 1 : offset - start;
  return fmt::format("{}:{}", line, column);
}

}  // namespace stylet::files
