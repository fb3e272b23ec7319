// Reference insertion R1, as content/reference ships it.
#pragma once

#include "tools/reference/reference_insertion.h"

#include <filesystem>

namespace stylet::support {

inline reference::ReferenceInsertion r1() {
  return reference::read_reference_insertion(std::filesystem::path(STYLET_SOURCE_DIR) / "content/reference/r1.json");
}

}  // namespace stylet::support
