// Organs of other programs become a whole scenario.
#pragma once

#include "engine/app/observer.h"
#include "engine/import/organ_source.h"
#include "engine/import/side_file.h"

#include <filesystem>
#include <vector>

namespace stylet::app {

/// Writes the scenario of a side file (its `scenario` is there) into a folder: scenario.json, organs.glb,
/// motion.json, the tissues, needle and probe it uses, report.txt, report.json and picture.png; all of them or none.
/// Loads what it wrote: what comes out can be trained. Notes what
/// its bodies came to.
/// @throws files::ContentError, Stopped
void import_scenario(const std::vector<import::SourceFile>& files, const import::SideFile& side,
                     const std::filesystem::path& folder, Observer& observer);

}  // namespace stylet::app
