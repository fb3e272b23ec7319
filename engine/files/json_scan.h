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

/// Text of a file as a one-line message can show it: control characters replaced, shortened to `bytes`.
std::string printable(std::string text, std::size_t bytes = 60);

/// "line:column" of a byte offset, both from 1.
std::string line_and_column(std::string_view text, std::size_t offset);

}  // namespace stylet::files
