// A look at JSON text before a parser builds anything from it: depth, duplicate keys, numbers that do not fit.
#pragma once

#include "engine/files/json_reader.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace stylet::files {

/// Something to refuse, by byte offset.
struct JsonScanFinding {
  std::size_t offset = 0;
  std::string what;
};

/// First finding of: nesting too deep, more values than accepted, a key twice in one object (unless allowed), a
/// number beyond double, NaN or infinity written as a word. Does not check syntax: the parser does. Linear time, no
/// recursion.
std::optional<JsonScanFinding> scan_json(std::string_view text, const JsonLimits& limits);

/// JSON has no other text: a path of Linux may be any bytes.
bool is_utf8(std::string_view text);

/// Text of a file as a line of a terminal can show it, shortened to `bytes`: a ? for what would act on the terminal,
/// end the line or turn it round (control characters, of C1 and DEL too, separators of lines, directions of writing),
/// and for bytes that are no UTF-8.
std::string printable(std::string_view text, std::size_t bytes = 60);
/// The same at any length.
inline std::string one_line(std::string_view text) {
  return printable(text, text.size() + 3);
}

/// "line:column" of a byte offset, both from 1.
std::string line_and_column(std::string_view text, std::size_t offset);

}  // namespace stylet::files
