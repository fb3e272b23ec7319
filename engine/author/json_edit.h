// Changes single values in the text of a JSON file. What is not changed keeps its bytes: order, unknown keys, spaces.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace stylet::author {

/// A way down from the root: keys of objects, numbers of the entries of lists.
using JsonPath = std::vector<std::string>;

/// The text with `value` (JSON) at `path`: in the place of the value that is there, else as the last member of its
/// object or entry of its list. A value that is there and says the same keeps its text. What the path leads through
/// is there, but for its last step. @throws files::ContentError  it is not, or `text` is no JSON
std::string with_value(std::string_view text, const JsonPath& path, std::string_view value);

/// The text without the member or entry at `path`; nothing there: as it is. @throws files::ContentError
std::string without_value(std::string_view text, const JsonPath& path);

}  // namespace stylet::author
