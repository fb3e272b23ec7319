// What `stylet --version` prints.
#pragma once

#include <string>

namespace stylet::tools {

/// Version, commit, build flags, libraries, BLAS in use, licence of the binary.
std::string version_text();

}  // namespace stylet::tools
