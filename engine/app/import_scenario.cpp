#include "engine/app/import_scenario.h"

#include "engine/app/build_name.h"
#include "engine/import/scenario_folder.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>

#include <algorithm>

namespace stylet::app {
namespace {

/// As the briefing has it: straight in within the image, to where the needle enters the target. The breath is held
/// from the start.
content::Motion plan_motion(const import::ImportedScene& scene, const content::Needle& needle) {
  // Of the target along the way, which ends at its middle.
  const double radius = scene.path.empty() ? 0
                                           : std::clamp(scene.path.back().to - scene.path.back().from,
                                                        motion::kLeastAimed, motion::kMostAimed);
  motion::BiopsyPlan plan = motion::demonstration(scene.entry, scene.target, radius, needle.length);
  plan.wait = 0.5;
  return motion::biopsy_motion(plan);
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
