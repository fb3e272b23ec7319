#include "engine/import/scenario_folder.h"

#include "engine/content/tissue_table.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/output_directory.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/import/scene_picture.h"
#include "engine/readers/instruments.h"
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <set>
#include <string>

namespace stylet::import {
namespace {

namespace fs = std::filesystem;
using files::ContentError;

constexpr std::size_t kJsonBytes = files::JsonLimits{}.bytes;
constexpr double kVolumeError = 0.03;  // relative, of a good mesh

/// A needle or probe as a side file names it: a file beside it, or the name of one of content/KINDs.
fs::path find_instrument(const SideFile& side, const std::string& pointer, const std::string& name,
                         const fs::path& content, const std::string& kind) {
  std::error_code error;
  const fs::path beside = side.path.parent_path() / name;
  if (fs::is_regular_file(beside, error)) return beside;
  const fs::path shipped = content / (kind + "s");
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(shipped, error)) {
    if (entry.path().extension() == ".json") names.insert(entry.path().stem().string());
  }
  if (names.contains(name)) return shipped / (name + ".json");
  std::string known;
  for (const std::string& each : names) known += (known.empty() ? "" : ", ") + each;
  throw ContentError(fmt::format("{}:{}: there is neither {} nor a {} of that name; name a file or one of: {}",
                                 side.path.string(), pointer, beside.string(), kind, known));
}

}  // namespace

ScenarioFolder write_scenario(const std::vector<SourceFile>& files, const SideFile& side, const fs::path& folder,
                              const fs::path& content, const std::string& generator, const PlanMotion& plan_motion,
                              const ImportProgress& progress) {
  const SideScenario& wanted = *side.scenario;
  const fs::path needle_path = find_instrument(side, wanted.pointer + "/needle", wanted.needle, content, "needle");
  const fs::path probe_path =
      find_instrument(side, wanted.pointer + "/probe/file", wanted.probe.file, content, "probe");
  const fs::path tissues_path = content / "tissues.json";
  files::JsonFile needle_file(needle_path);
  const content::Needle needle = readers::read_needle(needle_file);
  needle_file.throw_problems();
  files::JsonFile probe_file(probe_path);
  const content::Probe probe = readers::read_probe(probe_file);
  probe_file.throw_problems();
  files::JsonFile table_file(tissues_path);
  const content::TissueTable table = content::read_tissues(table_file);
  table_file.throw_problems();
  std::set<std::string> tissues;
  gltf::TissueColours colours;
  for (const content::Tissue& tissue : table.tissues) {
    tissues.insert(tissue.name);
    colours[tissue.name] = tissue.colour;
  }

  const ImportedScene imported = import_scene(files, side, tissues, probe, progress);

  files::OutputDirectory out(folder);
  const auto glb = gltf::write_glb(imported.surfaces, colours,
                                   {.generator = generator, .copyright = wanted.source, .scene = wanted.name});
  out.write("organs.glb", {reinterpret_cast<const char*>(glb.data()), glb.size()});
  out.write("tissues.json", files::read_file(tissues_path, kJsonBytes));
  out.write("needle.json", files::read_file(needle_path, kJsonBytes));
  out.write("probe.json", files::read_file(probe_path, kJsonBytes));
  out.named_in_place(
      [&] { readers::write_motion(plan_motion(imported, needle), wanted.name, out.staged("motion.json")); });
  out.write("scenario.json", scenario_json(imported, side));
  if (!side.proposed.empty()) out.write("side.json", side.proposed);

  ScenarioFolder written{.scenario = out.destination() / "scenario.json", .bodies = {}, .warnings = {}};
  std::vector<std::string> loading;
  content::Scene scene;
  try {
    scene = readers::load_scene(out.staged("scenario.json"), progress, &loading);
  } catch (const ContentError& error) {
    std::string what = out.in_place(error.what());  // of a file that nobody will find
    const std::string folder_name = out.destination().string() + "/";
    for (std::size_t at = what.find(folder_name); at != std::string::npos; at = what.find(folder_name, at)) {
      what.erase(at, folder_name.size());
    }
    throw ContentError(
        fmt::format("{}:{}: what it makes cannot be trained: {}", side.path.string(), wanted.pointer, what));
  }
  for (std::string& warning : loading) warning = out.in_place(warning);
  written.bodies = body_accounts(imported, scene);
  for (const BodyAccount& body : written.bodies) {
    const double error = body.volume / body.surface_volume - 1;
    if (std::abs(error) <= kVolumeError) continue;
    loading.push_back(
        fmt::format("the tetrahedra of {} miss the volume of its surface by {:+.1f} %; raise its "
                    "target_nodes, or choose a smaller cell_mm",
                    body.name, 100 * error));
  }
  out.write("report.json", scene_report_json(imported, scene, side, files, loading));
  out.write("report.txt", scene_report_text(imported, scene, side, files, loading));
  out.named_in_place([&] { picture::write_png(out.staged("picture.png"), scene_picture(imported, scene)); });
  out.commit("scenario.json");

  written.warnings = imported.warnings;
  written.warnings.insert(written.warnings.end(), loading.begin(), loading.end());
  return written;
}

}  // namespace stylet::import
