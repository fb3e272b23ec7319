// What an imported scenario leaves on disk, as text: the scenario itself and the account of how it was made.
#pragma once

#include "engine/content/scene.h"
#include "engine/import/scene_import.h"
#include "engine/import/side_file.h"

#include <string>
#include <vector>

namespace stylet::import {

/// The scenario of an imported scene (content/README.md, "stylet-scenario"). The files it names lie beside it:
/// tissues.json, needle.json, probe.json, motion.json, organs.glb. The same scene gives the same text.
std::string scenario_json(const ImportedScene& imported, const SideFile& side);

/// A deformable body as the session loads it.
struct BodyAccount {
  std::string name{};
  std::size_t nodes = 0, tetrahedra = 0, held = 0;
  double surface_volume = 0, volume = 0;  ///< of its boundary and of its tetrahedra, m^3
  double min_dihedral_deg = 0, max_dihedral_deg = 0;
  int inverted = 0;
};
std::vector<BodyAccount> body_accounts(const ImportedScene& imported, const content::Scene& scene);

/// The report as JSON, in SI units and degrees. @param loading  warnings of the loader
std::string scene_report_json(const ImportedScene& imported, const content::Scene& scene, const SideFile& side,
                              const std::vector<SourceFile>& files, const std::vector<std::string>& loading);

/// The report as a page of text for people.
std::string scene_report_text(const ImportedScene& imported, const content::Scene& scene, const SideFile& side,
                              const std::vector<SourceFile>& files, const std::vector<std::string>& loading);

}  // namespace stylet::import
