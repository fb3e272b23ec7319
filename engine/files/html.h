// Text and bytes within HTML and SVG.
#pragma once

#include <string>
#include <string_view>

namespace stylet::files::html {

/// Text as content or attribute; control characters become spaces.
std::string escaped(std::string_view text);

/// Bytes as in addresses that begin with "data:".
std::string base64(std::string_view bytes);

}  // namespace stylet::files::html
