// `stylet validate`: all problems of files at once.
#include "engine/files/json_reader.h"
#include "engine/import/side_file.h"
#include "engine/mesh/tet_quality.h"
#include "engine/readers/scenario.h"
#include "engine/recording/recording.h"
#include "engine/session/frame_publisher.h"
#include "engine/ultrasound/diagnosis.h"
#include "tools/reference/reference_insertion.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::tools {

namespace fs = std::filesystem;

namespace {

/// What a scenario amounts to, for those who build it: some lines.
std::string summary(const content::Scene& scene) {
  std::string text;
  for (const content::DeformableBody& body : scene.bodies) {
    const mesh::TetQuality quality = mesh::tet_quality(body.mesh);
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

constexpr std::string_view kReferenceInsertion = "stylet-reference-insertion";
constexpr std::string_view kSideFile = "stylet-import";

/// A file that Stylet reads, as far as its name and "format" tell; what it writes for people (session.json, reports)
/// and what belongs to other programs is not.
bool is_input(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".glb" || extension == ".gltf" || extension == ".rec") return true;
  if (extension != ".json") return false;
  try {
    const std::string format = readers::format_of(path);
    return format == kReferenceInsertion || format == kSideFile || readers::is_content_format(format);
  } catch (const files::ContentError&) {
    return true;  // to be told why
  }
}

/// A file named by itself is checked whatever it is.
std::vector<fs::path> files_of(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path, fs::directory_options::skip_permission_denied)) {
    if (entry.is_regular_file() && is_input(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  if (files.empty()) {
    throw files::ContentError(path.string() + ": holds no file that Stylet reads; name another folder");
  }
  return files;
}

struct Verdict {
  std::vector<std::string> problems{};
  std::vector<std::string> warnings{};
  std::string more{};  ///< of a sound file: lines about it
};

/// Why the first ultrasound image of a scenario will be black, before anything moves; empty: it shows something.
std::string black_image(const content::Scene& scene) {
  try {
    ultrasound::ScanModel model(scene, {});
    model.update(session::rest_frame(scene));
    return ultrasound::diagnose(model);
  } catch (const files::ContentError&) {
    return {};  // no image at all: other warnings say so
  }
}

/// Loading found it held oddly already.
bool warns_of_probe(const std::vector<std::string>& warnings) {
  return std::ranges::any_of(warnings,
                             [](const std::string& line) { return line.find(":/probe: ") != std::string::npos; });
}

Verdict verdict_on(const fs::path& path) {
  Verdict verdict;
  try {
    if (path.extension() == ".rec") {
      const recording::Recording recording = recording::read_recording(path);
      verdict.more = "  " + recording.condition() + '\n';
      if (!recording.complete()) {
        verdict.problems.push_back(path.string() + ": not whole (" + recording.condition() + "); record it again");
      }
      return verdict;
    }
    const std::string format = path.extension() == ".json" ? readers::format_of(path) : "";
    if (format == kReferenceInsertion) {
      (void)reference::read_reference_insertion(path);
      return verdict;
    }
    if (format == kSideFile) {
      files::JsonFile file(path);
      (void)import::read_side_file(file);
      verdict.problems = file.problems();
      return verdict;
    }
  } catch (const files::ContentError& error) {
    verdict.problems.emplace_back(error.what());
    return verdict;
  }
  std::optional<content::Scene> scene;
  verdict.problems = readers::validate(path, &scene, &verdict.warnings);
  if (scene) {
    verdict.more = summary(*scene);
    if (const std::string why = black_image(*scene); !why.empty() && !warns_of_probe(verdict.warnings)) {
      verdict.warnings.push_back(fmt::format("{}:/probe: the ultrasound image is black: {}", path.string(), why));
    }
  }
  return verdict;
}

}  // namespace

void add_validate(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("validate", "Check scenarios, organs, tissue tables, needles, probes, motions, recordings");
  auto paths = std::make_shared<std::vector<std::string>>();
  command->add_option("PATH", *paths, "Files, or folders of them; the kind is read from the file")->required();
  command->footer(
      "Prints every problem, one a line: file, place (JSON pointer or line), what is wrong and what to do.\n"
      "A scenario is checked with every file it names, and its organs are turned into tetrahedra; a sound one is\n"
      "summed up: nodes, tetrahedra, volumes. Of a folder, every *.glb, *.gltf, *.rec and content file (*.json)\n"
      "below it is checked.\n"
      "Exit code 0: sound; 2: problems were found.");
  command->callback([paths, &exit_code] {
    for (const std::string& path : *paths) {
      for (const fs::path& file : files_of(path)) {
        const Verdict verdict = verdict_on(file);
        for (const std::string& warning : verdict.warnings) print_warning(warning);
        for (const std::string& problem : verdict.problems) fmt::print("{}\n", problem);
        const bool sound = verdict.problems.empty();
        fmt::print("{}: {}\n", file.string(),
                   sound ? "sound" : fmt::format("{} problem(s)", verdict.problems.size()));
        if (sound) fmt::print("{}", verdict.more);
        if (!sound) exit_code = kExitBadInput;
      }
    }
  });
}

}  // namespace stylet::tools
