// `stylet import`: meshes and label volumes of other programs become organs that can be simulated.
#include "engine/content/tissue_table.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/output_directory.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/import/organ_files.h"
#include "engine/import/organ_import.h"
#include "engine/import/organ_labels.h"
#include "engine/import/organ_picture.h"
#include "engine/import/organ_source.h"
#include "engine/import/side_file.h"
#include "engine/readers/scenario.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/import_scene.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/progress.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
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
using import::ImportedOrgan;
using import::ImportSettings;
using import::OrganRequest;
using import::SourceSettings;

struct ImportOptions {
  std::vector<std::string> files;
  std::string side;
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
  std::string axes;
  std::string unit;
  bool list = false;
  std::vector<std::string> of_single_organs;  // options given that a scenario has no use for
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

/// The tissue of an organ: asked for, annotated, or the one whose name its id holds; empty: none of these.
std::string tissue_of(const import::OrganParts& organ, const std::map<std::string, std::string>& asked,
                      const std::vector<content::Tissue>& table, std::vector<std::string>& notes) {
  const auto found = asked.find(organ.id);
  if (found != asked.end()) return found->second;
  for (const import::SourcePart* part : organ.parts) {
    if (part->tissue && !part->tissue->preset.empty()) return part->tissue->preset;
  }
  std::string longest;
  for (const content::Tissue& tissue : table) {
    const std::string stem = tissue.name.substr(0, tissue.name.find('_'));
    if (organ.id.find(stem) != std::string::npos && stem.size() > longest.size()) longest = tissue.name;
  }
  notes.push_back(
      longest.empty()
          ? fmt::format("no tissue is known for it: say --tissue {}=NAME", organ.id)
          : fmt::format("its tissue is guessed from its name: {}; --tissue {}=NAME changes it", longest, organ.id));
  return longest;
}

void print_parts(const std::vector<import::SourceFile>& files) {
  for (const import::SourceFile& file : files) {
    fmt::print("{} ({}), {} part(s)\n", file.path.string(), file.format, file.parts.size());
    for (const std::string& assumption : file.assumptions) fmt::print("  {}\n", assumption);
    fmt::print("  {:<40} {:>9} {:>22}  {}\n", "part", "triangles", "size, mm", "organ");
    const auto voxels = file.image ? file.image->counts() : std::map<std::uint16_t, std::size_t>{};
    for (const import::SourcePart& part : file.parts) {
      if (part.label >= 0) {
        const double voxel = std::abs(file.image->patient_from_voxel.linear().determinant());
        const std::size_t count = voxels.at(static_cast<std::uint16_t>(part.label));
        fmt::print("  {:<40} {:>9} {:>19.4g} ml\n", part.name, count, 1e6 * voxel * static_cast<double>(count));
        continue;
      }
      Eigen::AlignedBox3d box;
      for (const Eigen::Vector3d& v : part.mesh.vertices) box.extend(v);
      const Eigen::Vector3d size = box.sizes() * 1e3;
      fmt::print("  {:<40} {:>9} {:>22}  {}\n", part.name, part.mesh.triangles.size(),
                 fmt::format("{:.0f} x {:.0f} x {:.0f}", size.x(), size.y(), size.z()), part.organ.id);
    }
  }
}

/// An organ to be written, with what lies in it.
struct WholeOrgan {
  ImportedOrgan organ;
  std::string tissue;
  std::vector<gltf::AnnotatedSurface> inside;
  std::optional<import::OrganLabels> labels;  ///< absent: nothing lies inside, or a tissue is not known
};

void write_organ(const WholeOrgan& whole, const import::OrganParts& parts, const gltf::TissueColours& colours,
                 const std::filesystem::path& folder) {
  files::OutputDirectory out(folder);
  const ImportedOrgan& organ = whole.organ;
  std::vector<gltf::AnnotatedSurface> surfaces{
      {.name = organ.id, .role = "boundary", .tissue = whole.tissue, .body = organ.id, .mesh = organ.surface}};
  surfaces.insert(surfaces.end(), whole.inside.begin(), whole.inside.end());
  const auto glb = gltf::write_glb(
      surfaces, colours, {.generator = "stylet import " + build_name(), .copyright = {}, .scene = organ.id});
  out.write("surface.glb", {reinterpret_cast<const char*>(glb.data()), glb.size()});
  out.write("tetrahedra.vtk", import::tetrahedra_vtk(organ, whole.labels ? &*whole.labels : nullptr));
  if (whole.labels) out.write("labels.vtk", import::labels_vtk(organ.id, whole.labels->volume));
  out.write("report.json", import::report_json(organ, parts));
  out.write("report.txt", import::report_text(organ, parts));
  picture::write_png(out.staged("picture.png"), import::organ_picture(organ));
  out.commit("report.json");
}

/// The parts that an organ of the list carries inside, in the order of the list.
std::vector<const import::OrganParts*> parts_inside(const import::OrganParts& organ,
                                                    const std::vector<import::OrganParts>& organs) {
  std::vector<const import::OrganParts*> inside;
  for (const import::OrganParts& other : organs) {
    if (other.lies_inside() && other.body == organ.id && &other != &organ) inside.push_back(&other);
  }
  return inside;
}

bool is_carried(const import::OrganParts& organ, const std::vector<import::OrganParts>& organs) {
  return organ.lies_inside() && std::any_of(organs.begin(), organs.end(), [&](const import::OrganParts& other) {
           return !other.lies_inside() && other.id == organ.body;
         });
}

/// Reads what lies inside and labels the organ by it.
void add_inside(WholeOrgan& whole, const std::vector<const import::OrganParts*>& inside,
                const std::map<std::string, std::string>& asked, const std::vector<content::Tissue>& table,
                const import::ImportProgress& progress) {
  std::vector<std::string>& notes = whole.organ.report.notes;
  const auto row = [&](const std::string& name) {
    return static_cast<int>(std::ranges::find(table, name, &content::Tissue::name) - table.begin());
  };
  const int rows = static_cast<int>(table.size());
  bool known = row(whole.tissue) < rows;
  std::vector<readers::Organ> organs;
  for (const import::OrganParts* part : inside) {
    ImportedOrgan imported = import::import_surface(*part, {}, progress);
    std::vector<std::string> of_part;
    const std::string tissue = tissue_of(*part, asked, table, of_part);
    for (const std::string& note : imported.report.notes) of_part.push_back(note);
    for (const std::string& note : of_part) notes.push_back(part->id + ": " + note);
    known = known && row(tissue) < rows;
    readers::Organ& organ = organs.emplace_back();
    organ.id = part->id;
    organ.role = part->role == "vessel"   ? content::SurfaceRole::vessel
                 : part->role == "target" ? content::SurfaceRole::target
                                          : content::SurfaceRole::region;
    organ.tissue = row(tissue);
    organ.mesh = imported.surface;
    whole.inside.push_back({.name = part->id,
                            .role = part->role,
                            .tissue = tissue,
                            .body = whole.organ.id,
                            .mesh = std::move(imported.surface)});
  }
  if (!known) {
    notes.emplace_back("no labels are written: a tissue is not known");
    return;
  }
  progress(whole.organ.id + ": labels");
  whole.labels = import::label_organ(whole.organ, row(whole.tissue), std::move(organs), table);
  whole.organ.report.labels = import::count_labels(*whole.labels, table);
}

/// The side file, where one is named.
std::optional<import::SideFile> read_side(const std::string& path) {
  if (path.empty()) return std::nullopt;
  files::JsonFile file{std::filesystem::path(path)};
  import::SideFile side = import::read_side_file(file);
  file.throw_problems();
  return side;
}

/// What the command line says of the tetrahedra counts before what the side file says of the organ.
ImportSettings import_settings(const ImportOptions& options, const std::optional<import::SideFile>& side,
                               const std::string& id) {
  ImportSettings settings{.cell = options.cell_mm * 1e-3,
                          .target_nodes = options.nodes,
                          .volume_error = options.volume_error_percent / 100,
                          .gap = options.gap_mm > 0 ? std::optional(options.gap_mm * 1e-3) : std::nullopt};
  if (options.mesher == "gmsh") settings.mesher = import::Mesher::gmsh;
  if (!options.grade_mm.empty()) {
    const std::vector<double>& mm = options.grade_mm;
    settings.grading = {.target = 1e-3 * Eigen::Vector3d(mm[0], mm[1], mm[2]), .factor = options.grade_factor};
  }
  if (!side || settings.cell > 0 || settings.target_nodes > 0) return settings;
  const auto organ = std::ranges::find(side->organs, id, &import::SideOrgan::id);
  if (organ == side->organs.end() || !organ->deformable) return settings;
  settings.cell = organ->cell;
  if (organ->cell == 0) settings.target_nodes = organ->target_nodes;
  return settings;
}

int run(const ImportOptions& options) {
  const SourceSettings settings = source_settings(options);
  const std::optional<import::SideFile> side = read_side(options.side);
  std::vector<OrganRequest> requests = organ_requests(options);
  std::map<std::string, std::string> asked;
  for (const std::string& text : options.tissues) asked.insert(split("--tissue", text));
  if (side) {
    for (const import::SideOrgan& organ : side->organs) {
      if (organ.role == "ignore") continue;
      requests.push_back({.id = organ.id,
                          .patterns = organ.parts,
                          .of_several_files = true,
                          .role = organ.role,
                          .body = organ.body});
      if (!organ.tissue.empty()) asked[organ.id] = organ.tissue;
    }
  }
  files::JsonFile table_file(readers::content_directory() / "tissues.json");
  const content::TissueTable table = content::read_tissues(table_file);
  table_file.throw_problems();
  gltf::TissueColours colours;
  for (const content::Tissue& tissue : table.tissues) colours[tissue.name] = tissue.colour;
  for (const auto& [id, tissue] : asked) {
    if (!colours.contains(tissue)) {
      throw ContentError(fmt::format("{} {}={}: there is no such tissue in content/tissues.json",
                                     side ? options.side : "--tissue", id, tissue));
    }
  }

  std::vector<import::SourceFile> files;
  for (const std::string& path : options.files) {
    files.push_back(import::read_source(path, settings));
    for (const std::string& warning : files.back().warnings) print_warning(warning);
  }
  if (options.list) {
    print_parts(files);
    return kExitYes;
  }
  if (side && side->scenario && !options.of_single_organs.empty()) {
    throw ContentError(
        fmt::format("{}: not with the scenario of {}, whose organs the side file describes (cell_mm, "
                    "target_nodes); leave it out",
                    fmt::join(options.of_single_organs, ", "), options.side));
  }
  if (options.out.empty()) throw ContentError("--out: give the folder for the organs, or --list to see the parts");
  if (side && side->scenario) {
    import_scenario(files, *side, options.out);
    return kExitYes;
  }

  Progress progress;
  int exit_code = kExitYes;
  const import::ImportProgress show = [&](const std::string& task) {
    throw_if_interrupted();
    progress.show(task, 0);
  };
  const std::vector<import::OrganParts> organs = import::assign_parts(files, requests);
  for (const import::OrganParts& parts : organs) {
    if (is_carried(parts, organs)) continue;
    const std::filesystem::path folder = std::filesystem::path(options.out) / parts.id;
    try {
      WholeOrgan whole;
      whole.organ = import::import_organ(parts, import_settings(options, side, parts.id), show);
      whole.tissue = tissue_of(parts, asked, table.tissues, whole.organ.report.notes);
      const auto inside = parts_inside(parts, organs);
      if (!inside.empty()) add_inside(whole, inside, asked, table.tissues, show);
      progress.done();
      write_organ(whole, parts, colours, folder);
      const import::ImportReport& r = whole.organ.report;
      fmt::print("{}: {:.4g} ml, {} nodes, {} tetrahedra, volume {:+.2f} %, smallest dihedral angle {:.1f} degrees\n",
                 folder.string(), r.volume * 1e6, r.nodes, r.tetrahedra, 100 * r.volume_error(),
                 r.quality.min_dihedral_deg);
      for (const std::string& note : r.notes) fmt::print("  {}\n", note);
    } catch (const ContentError& error) {
      progress.done();
      fmt::print(stderr, "stylet: {}\n", error.what());
      exit_code = kExitBadInput;
    }
  }
  return exit_code;
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("import", "Turn meshes and label volumes into organs that can be simulated");
  auto options = std::make_shared<ImportOptions>();
  command->add_option("FILE", options->files, "glTF (.glb, .gltf), STL, OBJ, or a NIfTI label volume (.nii, .nii.gz)")
      ->required();
  CLI::Option* side = command->add_option(
      "--side", options->side, "Side file (JSON): which parts make which organs, and how they become a scenario");
  command->add_option("--out", options->out,
                      "Folder for the results: one folder an organ; of a scenario, the folder itself");
  command->add_flag("--list", options->list, "Only list the parts of the files");
  command
      ->add_option("--organ", options->organs,
                   "ID=PATTERN[,PATTERN...]: the parts whose names fit (* and ?) make the organ ID; may be repeated")
      ->excludes(side);
  command->add_option("--tissue", options->tissues, "ID=TISSUE: a row of content/tissues.json; may be repeated")
      ->excludes(side);
  CLI::Option* cell = command->add_option("--cell", options->cell_mm, "Edge of the tetrahedra's lattice, mm")
                          ->check(CLI::Range(0.1, 200.0));
  command->add_option("--nodes", options->nodes, "Nodes wanted, within 5 %")
      ->check(CLI::Range(50, 200000))
      ->excludes(cell);
  command
      ->add_option("--volume-error", options->volume_error_percent,
                   "Without --cell and --nodes: the cell grows while the volume is off by less, %")
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
      "Each organ's folder holds\n"
      "  surface.glb      its closed surface, annotated, for scenarios\n"
      "  tetrahedra.vtk   its tetrahedra, for ParaView, Gmsh and SOFA\n"
      "  labels.vtk       where regions, vessels or targets lie in it: tissues as a volume, for ParaView\n"
      "  report.txt, .json  what was read, repaired and guessed\n"
      "  picture.png      surface and a cut through the tetrahedra, to look at\n"
      "With a side file that has a \"scenario\" (content/README.md, \"Side files\"; content/imports) the folder "
      "holds\n"
      "scenario.json and all it names, for stylet validate, train and render.\n"
      "Examples:\n"
      "  stylet import liver.stl --out organs\n"
      "  stylet import ts_abdomen.glb --side content/imports/ts_abdomen.json --out out/abdomen\n"
      "  stylet import VH_M_Liver.glb --list\n"
      "  stylet import VH_F_Liver.glb --organ 'liver=liver_capsule*,bare_area*' --nodes 5000 --out organs\n"
      "Exit code 0: every organ was made; 2: one was refused, the others were made.");
  command->callback([command, options, &exit_code] {
    for (const char* name :
         {"--cell", "--nodes", "--volume-error", "--gap", "--grade", "--grade-factor", "--mesher"}) {
      if (command->count(name) > 0) options->of_single_organs.emplace_back(name);
    }
    exit_code = run(*options);
  });
}

}  // namespace stylet::tools
