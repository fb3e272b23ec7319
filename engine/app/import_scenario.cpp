#include "engine/app/import_scenario.h"

#include "engine/app/build_name.h"
#include "engine/import/scenario_folder.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>

namespace stylet::app {
namespace {

/// Straight to the target and back and in again: how the hand makes up for what gives way is not known of a new
/// patient. The breath is held from the start.
content::Motion plan_motion(const import::ImportedScene& scene, const content::Needle& needle) {
  return motion::biopsy_motion({.entry = scene.entry,
                                .target = scene.target,
                                .needle_length = needle.length,
                                .wait = 0.5,
                                .lateral = 0.003,
                                .steer = 0,
                                .lead = 0,
                                .beyond = 0.001});
}

}  // namespace

void import_scenario(const std::vector<import::SourceFile>& files, const import::SideFile& side,
                     const std::filesystem::path& folder, Observer& observer) {
  import::ScenarioFolder written;
  try {
    written = import::write_scenario(
        files, side, folder, readers::content_directory(), "stylet import " + build_name(), plan_motion,
        [&](const std::string& task, double share) { show_progress(observer, task, share); });
  } catch (...) {
    observer.task_done();
    throw;
  }
  observer.task_done();
  for (const std::string& warning : written.warnings) observer.note(Note::warning, warning);
  for (const import::BodyAccount& body : written.bodies) {
    observer.note(Note::info,
                  fmt::format("{}: {:.4g} ml, {} nodes, {} tetrahedra, volume {:+.2f} %, smallest dihedral angle "
                              "{:.1f} degrees",
                              body.name, body.volume * 1e6, body.nodes, body.tetrahedra,
                              100 * (body.volume / body.surface_volume - 1), body.min_dihedral_deg));
  }
  observer.note(Note::info, written.scenario.string());
}

}  // namespace stylet::app
