// `stylet validate`: all problems of a content file at once.
#include "engine/content/scenario.h"
#include "engine/content/tet_quality.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stylet::tools {

namespace {

/// What a scenario amounts to, for those who build it: some lines.
std::string summary(const content::Scene& scene) {
  std::string text;
  for (const content::DeformableBody& body : scene.bodies) {
    const content::TetQuality quality = content::tet_quality(body.mesh);
    text += fmt::format(
        "  {:<12} {} nodes ({} fixed), {} tetrahedra, {:.3f} l, dihedral angles {:.0f} to {:.0f} degrees\n",
        body.name, body.mesh.nodes.size(), body.fixed_nodes.size(), body.mesh.tets.size(), quality.volume * 1e3,
        quality.min_dihedral_deg, quality.max_dihedral_deg);
  }
  std::size_t triangles = 0;
  for (const content::Surface& surface : scene.surfaces) triangles += surface.indices.size() / 3;
  text += fmt::format("  {:<12} {} with {} triangles\n", "surfaces", scene.surfaces.size(), triangles);
  text += fmt::format("  {:<12} {} x {} x {} voxels of {:.1f} mm\n", "anatomy", scene.labels.size.x(),
                      scene.labels.size.y(), scene.labels.size.z(), scene.labels.spacing * 1e3);
  text += fmt::format("  {:<12} {}, {} beams\n", "needle", scene.needle.name, scene.needle.beams);
  return text;
}

}  // namespace

void add_validate(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("validate", "Check a scenario, organ, tissue table, needle, probe or motion");
  auto paths = std::make_shared<std::vector<std::string>>();
  command->add_option("PATH", *paths, "Files to check; the kind is read from the file")->required();
  command->footer(
      "Prints every problem, one a line: file, place (JSON pointer or line), what is wrong and what to do.\n"
      "A scenario is checked with every file it names, and its organs are turned into tetrahedra; a sound one is\n"
      "summed up: nodes, tetrahedra, volumes.\n"
      "Exit code 0: sound; 2: problems were found.");
  command->callback([paths, &exit_code] {
    for (const std::string& path : *paths) {
      std::optional<content::Scene> scene;
      std::vector<std::string> warnings;
      const std::vector<std::string> problems = content::validate(path, &scene, &warnings);
      for (const std::string& warning : warnings) print_warning(warning);
      for (const std::string& problem : problems) fmt::print("{}\n", problem);
      fmt::print("{}: {}\n", path, problems.empty() ? "sound" : fmt::format("{} problem(s)", problems.size()));
      if (scene) fmt::print("{}", summary(*scene));
      if (!problems.empty()) exit_code = kExitBadInput;
    }
  });
}

}  // namespace stylet::tools
