// The keys of a scenario that say what is trained (content/README.md, "Exercise").
#pragma once

#include "engine/content/exercise.h"
#include "engine/files/json_reader.h"

#include <vector>

namespace stylet::readers {

/// The keys of a scenario that it reads.
std::vector<files::Key> exercise_keys();

/// Reads the keys `briefing`, `sampling` and `hints` of a scenario. Problems go to its file.
content::Exercise read_exercise(files::JsonObject& scenario);

}  // namespace stylet::readers
