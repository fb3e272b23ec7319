// For a process about to become another program: that program will see the mocked bus.
#pragma once

#include <cstdlib>
#include <string>

namespace stylet::support {

/// Puts the shim and umockdev first into LD_PRELOAD; UMOCKDEV_DIR is MockHidBus's.
inline void preload_mock() {
  const char* before = std::getenv("LD_PRELOAD");
  const std::string libraries = std::string(STYLET_HIDRAW_SHIM ":" STYLET_UMOCKDEV_PRELOAD) +
                                (before != nullptr ? std::string(":") + before : "");
  setenv("LD_PRELOAD", libraries.c_str(), 1);
}

}  // namespace stylet::support
