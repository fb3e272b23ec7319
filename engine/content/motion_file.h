// The reader of motion files, for those that hold the parsed file and want all of its problems.
#pragma once

#include "engine/content/json_reader.h"
#include "engine/content/motion.h"
#include "engine/content/scene.h"

namespace stylet::content {

/// An hour at 250 Hz.
inline constexpr JsonLimits kMotionLimits{.bytes = 128u << 20, .depth = 16};

/// Problems go to `file`.
Motion read_motion(JsonFile& file, RawReports* raw = nullptr);

}  // namespace stylet::content
