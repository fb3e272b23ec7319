// `stylet import`: meshes and label volumes of other programs become organs that can be simulated.
#include "engine/app/import_organs.h"

#include "engine/app/observer.h"
#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/terminal.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace stylet::tools {
namespace {

using files::ContentError;
// A line that begins with import:: is a module to clang-format.
using import::ImportSettings;
using import::OrganRequest;
using import::SourceSettings;

struct ImportOptions {
  std::vector<std::string> files;
  std::string side;
  std::string target;
  std::string out;
  std::vector<std::string> organs;   // ID=PATTERN,PATTERN
  std::vector<std::string> tissues;  // ID=PRESET
  double cell_mm = 0;
  int nodes = 0;
  double volume_error_percent = 3;
  double gap_mm = 0;
  std::vector<double> grade_mm;
  double grade_factor = 2;
  std::string mesher = "stuffing";
  std::string element = "linear";
  std::string axes;
  std::string unit;
  bool list = false;
  std::vector<std::string> of_single_organs;  // options given
};

/// "ID=rest" of an option that can be given several times.
std::pair<std::string, std::string> split(const std::string& option, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) {
    throw ContentError(fmt::format("{} {}: give {}", option, text,
                                   option == "--organ" ? "ID=PATTERN[,PATTERN...], such as liver=liver_*,bare_area*"
                                                       : "ID=TISSUE, such as liver=liver"));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<OrganRequest> organ_requests(const ImportOptions& options) {
  std::vector<OrganRequest> requests;
  for (const std::string& text : options.organs) {
    auto [id, patterns] = split("--organ", text);
    if (id.find('/') != std::string::npos || id.starts_with('.')) {
      throw ContentError(
          fmt::format("--organ {}: an id is the name of a folder too; no slash, no leading dot", text));
    }
    OrganRequest request{.id = id, .patterns = {}};
    std::istringstream list(patterns);
    for (std::string pattern; std::getline(list, pattern, ',');) {
      if (!pattern.empty()) request.patterns.push_back(pattern);
    }
    requests.push_back(std::move(request));
  }
  return requests;
}

SourceSettings source_settings(const ImportOptions& options) {
  SourceSettings settings;
  if (options.axes == "lps") settings.axes = import::Axes::lps;
  if (options.axes == "ras") settings.axes = import::Axes::ras;
  if (options.axes == "patient") settings.axes = import::Axes::patient;
  if (options.unit == "mm") settings.metres_per_unit = 1e-3;
  if (options.unit == "cm") settings.metres_per_unit = 1e-2;
  if (options.unit == "m") settings.metres_per_unit = 1;
  return settings;
}

/// Patient frame, with the voxels' own extent.
struct LabelBox {
  Eigen::AlignedBox3d box{};
  std::size_t voxels = 0;
};

std::map<int, LabelBox> label_boxes(const import::LabelImage& image, app::Observer& observer) {
  std::map<int, LabelBox> boxes;
  const Eigen::Vector3d half = 0.5 * image.patient_from_voxel.linear().cwiseAbs().rowwise().sum();
  std::size_t i = 0;
  for (int z = 0; z < image.size.z(); ++z) {
    app::throw_if_stopped(observer);
    for (int y = 0; y < image.size.y(); ++y) {
      for (int x = 0; x < image.size.x(); ++x, ++i) {
        if (image.labels[i] == 0) continue;
        LabelBox& label = boxes[image.labels[i]];
        const Eigen::Vector3d at = image.patient_from_voxel * Eigen::Vector3d(x, y, z);
        label.box.extend(at - half);
        label.box.extend(at + half);
        ++label.voxels;
      }
    }
  }
  return boxes;
}

void print_parts(const std::vector<import::SourceFile>& files, app::Observer& observer) {
  for (const import::SourceFile& file : files) {
    fmt::print("{} ({}), {} part(s)\n", files::one_line(file.path.string()), file.format, file.parts.size());
    for (const std::string& assumption : file.assumptions) fmt::print("  {}\n", assumption);
    const bool labels = file.image.has_value();
    fmt::print("  {:<40} {:>9} {:>10} {:>22} {:>24}  {}\n", "part", labels ? "voxels" : "triangles",
               labels ? "ml" : "", "size, mm", "middle, m", labels ? "" : "organ");
    const auto boxes = file.image ? label_boxes(*file.image, observer) : std::map<int, LabelBox>{};
    for (const import::SourcePart& part : file.parts) {
      Eigen::AlignedBox3d box;
      for (const Eigen::Vector3d& v : part.mesh.vertices) box.extend(v);
      std::size_t count = part.mesh.triangles.size();
      std::string volume;
      if (part.label >= 0) {
        box = boxes.at(part.label).box;
        count = boxes.at(part.label).voxels;
        const double voxel = std::abs(file.image->patient_from_voxel.linear().determinant());
        volume = fmt::format("{:.4g}", 1e6 * voxel * static_cast<double>(count));
      }
      const Eigen::Vector3d size = box.sizes() * 1e3, middle = box.center();
      fmt::print("  {:<40} {:>9} {:>10} {:>22} {:>24}  {}\n", files::one_line(part.name), count, volume,
                 fmt::format("{:.0f} x {:.0f} x {:.0f}", size.x(), size.y(), size.z()),
                 fmt::format("{:.3f}, {:.3f}, {:.3f}", middle.x(), middle.y(), middle.z()),
                 files::one_line(part.organ.id));
    }
  }
}

/// Of the tetrahedra.
ImportSettings mesh_settings(const ImportOptions& options) {
  ImportSettings settings{.cell = options.cell_mm * 1e-3,
                          .target_nodes = options.nodes,
                          .volume_error = options.volume_error_percent / 100,
                          .gap = options.gap_mm > 0 ? std::optional(options.gap_mm * 1e-3) : std::nullopt};
  if (options.element == "quadratic") settings.element = physics::Element::quadratic;
  if (options.mesher == "gmsh") settings.mesher = import::Mesher::gmsh;
  if (!options.grade_mm.empty()) {
    const std::vector<double>& mm = options.grade_mm;
    settings.grading = {.target = 1e-3 * Eigen::Vector3d(mm[0], mm[1], mm[2]), .factor = options.grade_factor};
  }
  return settings;
}

int run(const ImportOptions& options) {
  app::ImportOrgansSettings settings{.files = options.files,
                                     .source = source_settings(options),
                                     .side = options.side,
                                     .target = options.target,
                                     .out = options.out,
                                     .organs = organ_requests(options),
                                     .mesh = mesh_settings(options),
                                     .of_single_organs = options.of_single_organs};
  for (const std::string& text : options.tissues) settings.tissues.insert(split("--tissue", text));
  Terminal terminal;
  if (options.list) {
    print_parts(app::read_sources(settings, terminal), terminal);
    return kExitYes;
  }
  return app::import_organs(settings, terminal) ? kExitYes : kExitBadInput;
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("import", "Turn meshes and label volumes into organs that can be simulated");
  auto options = std::make_shared<ImportOptions>();
  command->add_option("FILE", options->files, "glTF (.glb, .gltf), STL, OBJ, or a NIfTI label volume (.nii, .nii.gz)")
      ->required();
  CLI::Option* side = command->add_option(
      "--side", options->side, "Side file (JSON): which parts make which organs, and how they become a scenario");
  CLI::Option* target =
      command
          ->add_option("--target", options->target,
                       "A part by its name: a whole scenario with it as the target, all else proposed. A lesion or "
                       "cyst; or an organ, in which a lesion is made up")
          ->excludes(side);
  command->add_option("--out", options->out,
                      "Folder for the results: one folder an organ; of a scenario, the folder itself");
  command->add_flag("--list", options->list,
                    "Only list the parts of the files: size, and where each is (patient frame)");
  command
      ->add_option("--organ", options->organs,
                   "ID=PATTERN[,PATTERN...]: the parts whose names fit (* and ?) make the organ ID; may be repeated")
      ->excludes(side)
      ->excludes(target);
  command->add_option("--tissue", options->tissues, "ID=TISSUE: a row of content/tissues.json; may be repeated")
      ->excludes(side)
      ->excludes(target);
  CLI::Option* cell =
      command
          ->add_option(
              "--cell", options->cell_mm,
              "Edge of the tetrahedra's lattice, mm; not so small that it makes more than about 200,000 nodes")
          ->check(CLI::Range(0.1, 200.0));
  command->add_option("--nodes", options->nodes, "Nodes wanted, within 5 %")
      ->check(CLI::Range(50, 200000))
      ->excludes(cell);
  command
      ->add_option(
          "--volume-error", options->volume_error_percent,
          "Without --cell and --nodes: the cell grows while the volume is off by less, %; 60,000 nodes at most")
      ->check(CLI::Range(0.1, 20.0))
      ->capture_default_str();
  command
      ->add_option("--gap", options->gap_mm, "Widest opening that is closed, mm; without it the smallest that works")
      ->check(CLI::Range(0.1, 50.0));
  CLI::Option* grade =
      command
          ->add_option("--grade", options->grade_mm,
                       "X,Y,Z in mm, patient frame: finer tetrahedra around this point, uniform ones at the surface")
          ->delimiter(',')
          ->expected(3);
  command
      ->add_option("--grade-factor", options->grade_factor,
                   "How much finer the tetrahedra at the point of --grade are")
      ->check(CLI::Range(1.0, 4.0))
      ->capture_default_str();
  command
      ->add_option(
          "--mesher", options->mesher,
          "stuffing, or gmsh where that program is installed: boundary nodes on the surface, angles as they come")
      ->check(CLI::IsMember({"stuffing", "gmsh"}))
      ->excludes(grade)
      ->capture_default_str();
  command
      ->add_option("--element", options->element,
                   "quadratic: tetrahedra in eights that are one element of ten nodes, which does not lock")
      ->check(CLI::IsMember({"linear", "quadratic"}))
      ->capture_default_str();
  command
      ->add_option("--axes", options->axes, "Of STL and OBJ: lps, ras or patient (+X left, +Y superior, +Z anterior)")
      ->check(CLI::IsMember({"lps", "ras", "patient"}));
  command->add_option("--unit", options->unit, "Of STL and OBJ: mm, cm or m")
      ->check(CLI::IsMember({"mm", "cm", "m"}));
  command->footer(
      "An organ is a set of parts (glTF nodes, STL solids, OBJ objects, labels). Without --organ: the parts with "
      "the\n"
      "same extras.organ.id; in files without any, each closed part is an organ, and the others make one together.\n"
      "The parts are welded and cleaned; where they do not close, the inside is what cannot be reached from "
      "outside.\n"
      "Each piece of the organ gets tetrahedra, if it holds a few cells; the report lists them.\n"
      "Limits, each told with what to do: 5 million triangles or 250 million voxels a file, 2,000 organs,\n"
      "a minute or so an organ. Ctrl-C ends it within a second, whatever it is at; finished organs stay.\n"
      "Each organ's folder holds\n"
      "  surface.glb      its closed surface, annotated, for scenarios\n"
      "  tetrahedra.vtk   its tetrahedra, for ParaView, Gmsh and SOFA\n"
      "  labels.vtk       where regions, vessels or targets lie in it: tissues as a volume, for ParaView\n"
      "  report.txt, .json  what was read, repaired and guessed\n"
      "  picture.png      surface and a cut through the tetrahedra, to look at\n"
      "With --target the folder becomes a scenario: body, needle, probe, camera, score and hints are proposed, and\n"
      "side.json says what each part was taken for, to be corrected and given as --side. Then stylet author.\n"
      "With a side file that has a \"scenario\" (content/README.md, \"Side files\"; content/imports) the folder "
      "holds\n"
      "scenario.json and all it names, for stylet validate, train and render.\n"
      "Examples:\n"
      "  stylet import liver.stl --out organs\n"
      "  stylet import ts_abdomen.glb --side content/imports/ts_abdomen.json --out out/abdomen\n"
      "  stylet import labels.nii.gz --list\n"
      "  stylet import labels.nii.gz --target liver --out out/case1\n"
      "  stylet import VH_F_Liver.glb --organ 'liver=liver_capsule*,bare_area*' --nodes 5000 --out organs\n"
      "Exit code 0: every organ was made; 2: one was refused, the others were made.");
  command->callback([command, options, &exit_code] {
    for (const char* name :
         {"--cell", "--nodes", "--volume-error", "--gap", "--grade", "--grade-factor", "--mesher", "--element"}) {
      if (command->count(name) > 0) options->of_single_organs.emplace_back(name);
    }
    exit_code = run(*options);
  });
}

}  // namespace stylet::tools
