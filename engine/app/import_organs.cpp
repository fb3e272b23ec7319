#include "engine/app/import_organs.h"

#include "engine/app/build_name.h"
#include "engine/app/import_scenario.h"
#include "engine/content/tissue_table.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/output_directory.h"
#include "engine/files/pulse.h"
#include "engine/gltf/gltf_writer.h"
#include "engine/import/organ_files.h"
#include "engine/import/organ_labels.h"
#include "engine/import/organ_picture.h"
#include "engine/import/side_file.h"
#include "engine/import/side_proposal.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace stylet::app {
namespace {

using files::ContentError;
// A line that begins with import:: is a module to clang-format.
using import::ImportedOrgan;
using import::ImportSettings;
using import::OrganRequest;

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
  out.named_in_place([&] { picture::write_png(out.staged("picture.png"), import::organ_picture(organ)); });
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
  progress(whole.organ.id + ": labels", 0);
  whole.labels = import::label_organ(whole.organ, row(whole.tissue), std::move(organs), table);
  whole.organ.report.labels = import::count_labels(*whole.labels, table);
}

/// The side file, where one is named.
std::optional<import::SideFile> read_side(const std::filesystem::path& path) {
  if (path.empty()) return std::nullopt;
  files::JsonFile file{path};
  import::SideFile side = import::read_side_file(file);
  file.throw_problems();
  return side;
}

/// As it will be left in the folder.
import::SideFile propose_side(const std::vector<import::SourceFile>& files, const std::string& target,
                              const std::filesystem::path& folder, const std::string& name){
    const std::string text = import::propose_side_text(files, target, name);
files::JsonFile file(folder / "side.json", text);
import::SideFile side = import::read_side_file(file);
file.throw_problems();
side.proposed = text;
return side;
}  // namespace

/// What was asked for of the tetrahedra counts before what the side file says of the organ.
ImportSettings mesh_settings(ImportSettings settings, const std::optional<import::SideFile>& side,
                             const std::string& id) {
  if (!side) return settings;
  const auto organ = std::ranges::find(side->organs, id, &import::SideOrgan::id);
  if (organ == side->organs.end() || !organ->deformable) return settings;
  if (organ->element == physics::Element::quadratic) settings.element = organ->element;
  if (settings.cell > 0 || settings.target_nodes > 0) return settings;
  settings.cell = organ->cell;
  if (organ->cell == 0) settings.target_nodes = organ->target_nodes;
  return settings;
}

/// The tissue table, which has the tissues asked for.
content::TissueTable tissue_table(const std::map<std::string, std::string>& asked, const std::string& asked_in) {
  files::JsonFile table_file(readers::content_directory() / "tissues.json");
  content::TissueTable table = content::read_tissues(table_file);
  table_file.throw_problems();
  for (const auto& [id, tissue] : asked) {
    if (std::ranges::find(table.tissues, tissue, &content::Tissue::name) == table.tissues.end()) {
      throw ContentError(
          fmt::format("{} {}={}: there is no such tissue in content/tissues.json", asked_in, id, tissue));
    }
  }
  return table;
}

}  // namespace stylet::app

std::vector<import::SourceFile> read_sources(const ImportOrgansSettings& settings, Observer& observer) {
  std::vector<import::SourceFile> sources;
  for (const std::string& path : settings.files) {
    const files::Pulse pulse = [&, task = "reading " + path] { show_progress(observer, task, 0); };
    sources.push_back(import::read_source(path, settings.source, pulse));
    for (const std::string& warning : sources.back().warnings) observer.note(Note::warning, warning);
  }
  observer.task_done();
  return sources;
}

bool import_organs(const ImportOrgansSettings& settings, Observer& observer) {
  if (!settings.target.empty()) {
    if (settings.out.empty())
      throw ContentError("--out: give the folder for the scenario, or --list to see the parts");
    const std::vector<import::SourceFile> files = read_sources(settings, observer);
    const std::string name = settings.out.lexically_normal().filename().string();
    import_scenario(files, propose_side(files, settings.target, settings.out, name.empty() ? "imported" : name),
                    settings.out, observer);
    return true;
  }
  const std::optional<import::SideFile> side = read_side(settings.side);
  std::vector<OrganRequest> requests = settings.organs;
  std::map<std::string, std::string> asked = settings.tissues;
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
  const content::TissueTable table = tissue_table(asked, side ? settings.side.string() : "--tissue");
  gltf::TissueColours colours;
  for (const content::Tissue& tissue : table.tissues) colours[tissue.name] = tissue.colour;
  const std::vector<import::SourceFile> files = read_sources(settings, observer);
  if (side && side->scenario && !settings.of_single_organs.empty()) {
    throw ContentError(
        fmt::format("{}: not with the scenario of {}, whose organs the side file describes (cell_mm, "
                    "target_nodes); leave it out",
                    fmt::join(settings.of_single_organs, ", "), settings.side.string()));
  }
  if (settings.out.empty()) throw ContentError("--out: give the folder for the organs, or --list to see the parts");
  if (side && side->scenario) {
    import_scenario(files, *side, settings.out, observer);
    return true;
  }

  bool all = true;
  const import::ImportProgress show = [&](const std::string& task, double share) {
    show_progress(observer, task, share);
  };
  const std::vector<import::OrganParts> organs =
      import::assign_parts(files, requests, [&] { show("telling the organs apart", 0); });
  for (const import::OrganParts& parts : organs) {
    if (is_carried(parts, organs)) continue;
    const std::filesystem::path folder = settings.out / parts.id;
    try {
      WholeOrgan whole;
      whole.organ = import::import_organ(parts, mesh_settings(settings.mesh, side, parts.id), show);
      whole.tissue = tissue_of(parts, asked, table.tissues, whole.organ.report.notes);
      const auto inside = parts_inside(parts, organs);
      if (!inside.empty()) add_inside(whole, inside, asked, table.tissues, show);
      observer.task_done();
      write_organ(whole, parts, colours, folder);
      const import::ImportReport& r = whole.organ.report;
      observer.note(Note::info,
                    fmt::format("{}: {:.4g} ml, {} nodes, {} tetrahedra, volume {:+.2f} %, smallest dihedral angle "
                                "{:.1f} degrees",
                                folder.string(), r.volume * 1e6, r.nodes, r.tetrahedra, 100 * r.volume_error(),
                                r.quality.min_dihedral_deg));
      for (const std::string& note : r.notes) observer.note(Note::info, "  " + note);
    } catch (const ContentError& error) {
      observer.task_done();
      observer.note(Note::notice, error.what());
      all = false;
    }
  }
  return all;
}

}  // namespace stylet::app
