#include "engine/app/build_name.h"

#include "stylet_commit.h"  // made at build time: STYLET_COMMIT

#include <fmt/format.h>

namespace stylet::app {

std::string build_name() {
  return fmt::format("{} (commit {})", STYLET_VERSION, STYLET_COMMIT);
}

}  // namespace stylet::app
