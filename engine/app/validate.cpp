#include "engine/app/validate.h"

#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/import/side_file.h"
#include "engine/lab/course/course_file.h"
#include "engine/mesh/tet_quality.h"
#include "engine/readers/scenario.h"
#include "engine/recording/recording.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/frame_publisher.h"
#include "engine/ultrasound/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

namespace stylet::app {

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

/// The gates of a course and what each is worth.
std::string summary(const lab::course::Course& course) {
  std::string text;
  for (const lab::course::Exercise& exercise : course.exercises) {
    text += fmt::format("  {:<12} {}\n", exercise.name, lab::course::gate_words(exercise));
    if (exercise.monitoring) {
      text +=
          fmt::format("  {:<12} alarm at {:.2f}: false within {} attempts with probability {:.2f} at most\n", "",
                      exercise.monitoring->limit, exercise.monitoring->attempts, exercise.monitoring->false_alarm);
    }
  }
  return text;
}

constexpr std::string_view kSideFile = "stylet-import";

/// A file that Stylet reads, as far as its name and "format" tell; what it writes for people (session.json, reports)
/// and what belongs to other programs is not.
bool is_input(const fs::path& path, const OtherFormats& others) {
  const std::string extension = path.extension().string();
  if (extension == ".glb" || extension == ".gltf" || extension == ".rec") return true;
  if (extension != ".json") return false;
  try {
    const std::string format = readers::format_of(path);
    return others.contains(format) || format == kSideFile || format == lab::course::course_format().id ||
           readers::is_content_format(format);
  } catch (const files::ContentError&) {
    return true;  // to be told why
  }
}

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

/// Why a session of it cannot begin: what only the loops find, such as a body that its held nodes let turn; empty: it
/// can.
std::string why_no_session(const content::Scene& scene) {
  try {
    const content::MotionSample& hand = scene.motion.stylus.front();
    const session::CoupledLoops loops(scene, session::coupling_from_name(scene.coupling), hand.pose, {});
    return {};
  } catch (const files::ContentError& error) {
    return error.what();
  }
}

/// Loading found it held oddly already.
bool warns_of_probe(const std::vector<std::string>& warnings) {
  return std::ranges::any_of(warnings,
                             [](const std::string& line) { return line.find(":/probe: ") != std::string::npos; });
}

}  // namespace

std::vector<fs::path> files_to_validate(const fs::path& path, const OtherFormats& others) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path, fs::directory_options::skip_permission_denied)) {
    if (entry.is_regular_file() && is_input(entry.path(), others)) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  if (files.empty()) {
    throw files::ContentError(path.string() + ": holds no file that Stylet reads; name another folder");
  }
  return files;
}

Verdict validate(const fs::path& path, const OtherFormats& others) {
  Verdict verdict;
  try {
    if (path.extension() == ".rec") {
      const recording::Recording recording = recording::read_recording(path);
      verdict.summary = "  " + recording.condition() + '\n';
      if (!recording.complete()) {
        verdict.problems.push_back(path.string() + ": not whole (" + recording.condition() + "); record it again");
      }
      return verdict;
    }
    const std::string format = path.extension() == ".json" ? readers::format_of(path) : "";
    if (const auto other = others.find(format); other != others.end()) {
      other->second(path);
      return verdict;
    }
    if (format == kSideFile) {
      files::JsonFile file(path);
      (void)import::read_side_file(file);
      verdict.problems = file.problems();
      return verdict;
    }
    if (format == lab::course::course_format().id) {
      files::JsonFile file(path);
      const lab::course::Course course = lab::course::read_course(file, &verdict.warnings);
      verdict.problems = file.problems();
      verdict.summary = summary(course);
      return verdict;
    }
  } catch (const files::ContentError& error) {
    verdict.problems.emplace_back(error.what());
    return verdict;
  }
  std::optional<content::Scene> scene;
  verdict.problems = readers::validate(path, &scene, &verdict.warnings);
  if (scene) {
    if (std::string why = why_no_session(*scene); !why.empty()) verdict.problems.push_back(std::move(why));
    verdict.summary = summary(*scene);
    if (const std::string why = black_image(*scene); !why.empty() && !warns_of_probe(verdict.warnings)) {
      verdict.warnings.push_back(fmt::format("{}:/probe: the ultrasound image is black: {}", path.string(), why));
    }
  }
  return verdict;
}

}  // namespace stylet::app
