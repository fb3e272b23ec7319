// What recordings, manifests and organs say they were made by.
#pragma once

#include <string>

namespace stylet::app {

/// "0.1.0 (commit abc1234)"
std::string build_name();

}  // namespace stylet::app
