// Scenes for those who edit them.
#pragma once

#include "engine/readers/scenario.h"

namespace stylet::readers {

/// As load_scene(). @param organs  gets the organ's id of every surface of the scene
content::Scene load_scene_with_organs(const std::filesystem::path& scenario, const LoadProgress& progress,
                                      std::vector<std::string>& warnings, std::vector<std::string>& organs);

}  // namespace stylet::readers
