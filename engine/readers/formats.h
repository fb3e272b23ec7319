// The formats that this room reads, with their keys.
#pragma once

#include "engine/files/key.h"

#include <vector>

namespace stylet::readers {

std::vector<files::FileFormat> formats();

}  // namespace stylet::readers
