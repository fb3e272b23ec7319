// The reader of motion files, for those that hold the parsed file and want all of its problems.
#pragma once

#include "engine/content/scene.h"
#include "engine/files/json_reader.h"
#include "engine/readers/motion.h"

namespace stylet::readers {

/// An hour at 250 Hz.
inline constexpr files::JsonLimits kMotionLimits{.bytes = 128u << 20, .depth = 16};

/// Its keys.
const files::FileFormat& motion_format();

/// Problems go to `file`.
content::Motion read_motion(files::JsonFile& file, RawReports* raw = nullptr);

}  // namespace stylet::readers
