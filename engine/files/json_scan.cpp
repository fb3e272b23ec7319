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

/// Bytes of the UTF-8 character that a text begins with; 0: it is none.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool surrogate = first == 0xED && byte(1) >= 0xA0;
  const bool beyond = first == 0xF4 && byte(1) >= 0x90;
  return overlong || surrogate || beyond ? 0 : length;
}

/// Whether a character does something to a terminal beyond standing there.
bool acts(std::string_view character) {
  if (character.size() == 1) return static_cast<unsigned char>(character[0]) < 0x20 || character[0] == 0x7F;
  if (character.size() == 2) return character[0] == '\xC2' && static_cast<unsigned char>(character[1]) < 0xA0;
  // U+2028 to 202E: separators, directions; U+2066 to 2069: directions.
  return (character >= "\xE2\x80\xA8" && character <= "\xE2\x80\xAE") ||
         (character >= "\xE2\x81\xA6" && character <= "\xE2\x81\xA9");
}

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string printable(std::string_view text, std::size_t bytes) {
  std::string out;
  std::size_t cut = 0;  // where there is room for the dots
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    text.remove_prefix(character.size());
    if (length == 0 || acts(character)) {
      out += '?';
    } else {
      out += character;
    }
    if (out.size() + 3 <= bytes) cut = out.size();
    if (out.size() > bytes) return out.substr(0, cut) + "...";
  }
  return out;
}

std::optional<JsonScanFinding> scan_json(std::string_view text, const JsonLimits& limits) {
  std::vector<Level> levels;
  std::size_t values = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((c == ',' || c == '{' || c == '[') && ++values > limits.values) {
      return JsonScanFinding{i, fmt::format("has more than {} values; split the file", limits.values)};
    }
    if (c == '\0' && text.find_first_not_of(std::string_view("\0 \t\r\n", 5), i) != std::string_view::npos) {
      return JsonScanFinding{i, "a NUL, where the parser stops, and more behind it; save it again as text"};
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
