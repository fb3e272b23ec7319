// What is made of a format's table of keys: its JSON schema, the table in content/README.md, the table for a
// terminal.
#pragma once

#include "engine/files/key.h"

#include <string>
#include <string_view>
#include <vector>

namespace stylet::files {

/// JSON Schema 2020-12, as content/schemas/NAME.schema.json holds it.
std::string json_schema(const FileFormat& format);

/// A row a key, those of objects under their path: `bodies[].mesh.cell_mm`.
std::string markdown_table(const FileFormat& format);

/// The same with indentation in place of paths, in columns.
std::string plain_table(const FileFormat& format);

/// A table of Markdown; bars in cells are escaped.
std::string markdown_table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

/// Columns of text as wide as they need, all but the last.
std::string columns(const std::vector<std::vector<std::string>>& rows);

/// `page` with `text` between its lines "<!-- stylet schema NAME -->" and "<!-- end -->".
/// @throws ContentError it has no such lines
std::string with_generated(std::string page, std::string_view name, std::string_view text);

}  // namespace stylet::files
