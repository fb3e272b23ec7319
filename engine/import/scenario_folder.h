// An imported scenario on disk: a folder that holds all it needs, or nothing.
#pragma once

#include "engine/content/scene.h"
#include "engine/import/scene_files.h"
#include "engine/import/scene_import.h"
#include "engine/import/side_file.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace stylet::import {

/// The recorded hand for a scene.
using PlanMotion = std::function<content::Motion(const ImportedScene& scene, const content::Needle& needle)>;

struct ScenarioFolder {
  std::filesystem::path scenario{};  ///< DIR/scenario.json
  std::vector<BodyAccount> bodies{};
  std::vector<std::string> warnings{};  ///< of the import and of loading what it wrote, one line each
};

/// Imports the scenario of a side file (it has one) and leaves in a folder scenario.json, organs.glb, motion.json,
/// the tissues.json, needle.json and probe.json that it uses, report.txt, report.json, picture.png and a side file
/// that was proposed (side.json); all of them or none. What it wrote is loaded before it is put there: it can be
/// trained. The same input gives the same bytes.
/// @param content    content_directory(): the tissue table, needles and probes by name
/// @param generator  named in organs.glb
/// @throws files::ContentError  "file:pointer: what; what to do"
ScenarioFolder write_scenario(const std::vector<SourceFile>& files, const SideFile& side,
                              const std::filesystem::path& folder, const std::filesystem::path& content,
                              const std::string& generator, const PlanMotion& plan_motion,
                              const ImportProgress& progress);

}  // namespace stylet::import
