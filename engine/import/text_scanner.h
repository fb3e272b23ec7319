// Words and numbers of a line-based text file, without trusting it.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace stylet::import {

/// Takes a text apart line by line, and a line word by word. Views into the text; no copies.
class TextScanner {
public:
  explicit TextScanner(std::string_view text) : rest_(text) {}

  /// Goes to the next line; false at the end. A line ends with \n or \r\n.
  bool next_line() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    ++number_;
    return true;
  }

  /// The next word of the line, empty at its end.
  std::string_view word() {
    skip_blanks();
    std::size_t end = 0;
    while (end < line_.size() && !is_blank(line_[end])) ++end;
    const std::string_view word = line_.substr(0, end);
    line_.remove_prefix(end);
    return word;
  }

  /// What is left of the line, without blanks around it.
  std::string_view remainder() {
    skip_blanks();
    std::string_view text = line_;
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
  }

  std::size_t line_number() const { return number_; }

private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r'; }
  void skip_blanks() {
    while (!line_.empty() && is_blank(line_.front())) line_.remove_prefix(1);
  }

  std::string_view rest_;
  std::string_view line_;
  std::size_t number_ = 0;
};

/// The finite number that a word is, whatever the locale; nothing where it is anything else.
inline std::optional<double> to_number(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return {};
  return value;
}

inline std::optional<long long> to_integer(std::string_view word) {
  long long value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return {};
  return value;
}

}  // namespace stylet::import
