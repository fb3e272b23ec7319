// The motion to compare with: the scenario's own, run once and remembered, or another recording.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/collect.h"
#include "engine/session/run_statistics.h"

#include <filesystem>
#include <string_view>

namespace stylet::debrief {

/// Runs the scenario's motion in lockstep, without pictures. The scene has a motion.
Expert run_expert_motion(const content::Scene& scene, const session::RunProgress& progress = {});

/// The same, from `cache` where an earlier session of the same build and scene left it there, and left there
/// otherwise; a folder that cannot be written to costs time only.
Expert expert_motion(const content::Scene& scene, std::string_view build, const std::filesystem::path& cache,
                     const session::RunProgress& progress = {});

/// $XDG_CACHE_HOME/stylet, else $HOME/.cache/stylet; empty where neither is known.
std::filesystem::path expert_cache();

/// Another recording of the same scenario, replayed.
/// @throws files::ContentError  no recording, or of another scenario
Expert expert_recording(const content::Scene& scene, const std::filesystem::path& recording,
                        const session::RunProgress& progress = {});

}  // namespace stylet::debrief
