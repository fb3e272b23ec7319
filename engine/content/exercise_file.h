// The keys of a scenario that say what is trained (content/README.md, "Exercise").
#pragma once

#include "engine/content/exercise.h"
#include "engine/content/json_reader.h"

namespace stylet::content {

/// Reads the keys `briefing`, `sampling` and `hints` of a scenario. Problems go to its file.
Exercise read_exercise(JsonObject& scenario);

}  // namespace stylet::content
