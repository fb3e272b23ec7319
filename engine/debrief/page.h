// The debrief as one HTML file that needs nothing else: no network, no other file, and for its numbers no scripts.
#pragma once

#include "engine/debrief/debrief_data.h"

#include <string>

namespace stylet::debrief {

/// Scripts turn the needle's way, follow the mouse in the plots and nothing else; a Content-Security-Policy forbids
/// every request and every script but the page's own. All texts are escaped.
std::string debrief_page(const DebriefData& data);

}  // namespace stylet::debrief
