#include "engine/import/organ_files.h"

#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/tet_quality.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <numbers>

namespace stylet::import {
namespace {

const char* name_of(SolidFrom from) {
  switch (from) {
    case SolidFrom::closed_surface:
      return "closed surface";
    case SolidFrom::enclosure:
      return "what the surface encloses";
    case SolidFrom::labels:
      return "labels of a volume";
  }
  return "";
}

/// The pieces of an organ, largest first.
template <typename Out>
void print_pieces(Out out, const ImportReport& report) {
  constexpr std::size_t kLines = 20;
  std::vector<PieceReport> pieces = report.pieces;
  if (pieces.size() < 2) return;
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const PieceReport& a, const PieceReport& b) { return a.volume > b.volume; });
  for (std::size_t p = 0; p < std::min(pieces.size(), kLines); ++p) {
    fmt::format_to(out, "{:<14} {:>9.4g} ml; tetrahedra ", p == 0 ? "pieces" : "", pieces[p].volume * 1e6);
    if (pieces[p].tetrahedra == 0) {
      fmt::format_to(out, "none, left out\n");
    } else {
      fmt::format_to(out, "{:.4g} ml ({:+.2f} %)\n", pieces[p].tetrahedra * 1e6,
                     100 * (pieces[p].tetrahedra / pieces[p].volume - 1));
    }
  }
  if (pieces.size() > kLines) fmt::format_to(out, "               and {} smaller ones\n", pieces.size() - kLines);
}

/// Names of the files an organ comes from.
std::string file_names(const OrganParts& parts) {
  std::string names = parts.file->path.filename().string();
  for (const SourceFile* other : parts.other_files) names += ", " + other->path.filename().string();
  return names;
}

}  // namespace

std::string tetrahedra_vtk(const ImportedOrgan& organ, const OrganLabels* labels) {
  const physics::TetMesh& mesh = organ.mesh;
  std::string text = fmt::format(
      "# vtk DataFile Version 3.0\nStylet organ {}: metres, +X left, +Y superior, +Z anterior\nASCII\n"
      "DATASET UNSTRUCTURED_GRID\nPOINTS {} double\n",
      organ.id, mesh.nodes.size());
  const auto out = std::back_inserter(text);
  for (const Eigen::Vector3d& x : mesh.nodes) fmt::format_to(out, "{} {} {}\n", x.x(), x.y(), x.z());
  fmt::format_to(out, "CELLS {} {}\n", mesh.tets.size(), 5 * mesh.tets.size());
  for (const auto& t : mesh.tets) fmt::format_to(out, "4 {} {} {} {}\n", t[0], t[1], t[2], t[3]);
  fmt::format_to(out, "CELL_TYPES {}\n", mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) text += "10\n";  // VTK_TETRA
  fmt::format_to(out, "CELL_DATA {}\nSCALARS min_dihedral_deg float 1\nLOOKUP_TABLE default\n", mesh.tets.size());
  for (const auto& tet : mesh.tets) {
    const auto corner = [&](std::size_t c) { return mesh.nodes[tet[c]]; };
    fmt::format_to(out, "{:.2f}\n",
                   mesh::dihedral_range(corner(0), corner(1), corner(2), corner(3)).min * 180 / std::numbers::pi);
  }
  if (labels == nullptr) return text;
  text += "SCALARS tissue unsigned_char 1\nLOOKUP_TABLE default\n";
  for (const std::uint8_t tissue : labels->tet_tissue) fmt::format_to(out, "{}\n", tissue);
  text += "SCALARS young_modulus_pa double 1\nLOOKUP_TABLE default\n";
  for (const physics::ElasticMaterial& material : labels->tet_mechanics) {
    fmt::format_to(out, "{}\n", material.young_modulus);
  }
  return text;
}

std::string report_json(const ImportedOrgan& organ, const OrganParts& parts) {
  const ImportReport& r = organ.report;
  const mesh::SurfaceReport surface = mesh::inspect(organ.surface);
  nlohmann::ordered_json json;
  json["format"] = "stylet-organ-report";
  json["version"] = 1;
  json["organ"] = organ.id;
  json["source"] = {
      {"file", file_names(parts)}, {"format", parts.file->format}, {"assumptions", parts.file->assumptions}};
  for (const SourcePart* part : parts.parts) json["source"]["parts"].push_back(part->name);
  json["read"] = {{"triangles", r.triangles_read},
                  {"triangles_after_welding", r.triangles},
                  {"dropped", r.dropped},
                  {"turned", r.turned},
                  {"components", r.components},
                  {"open_edges", r.boundary_edges},
                  {"non_manifold_edges", r.non_manifold_edges},
                  {"welded_volume_m3", r.welded_volume}};
  json["solid"] = {{"from", name_of(r.from)}, {"gap_m", r.gap}, {"volume_m3", r.volume}};
  for (const PieceReport& piece : r.pieces) {
    json["solid"]["pieces"].push_back({{"volume_m3", piece.volume}, {"tetrahedra_m3", piece.tetrahedra}});
  }
  json["surface"] = {{"vertices", surface.vertices},
                     {"triangles", surface.triangles},
                     {"area_m2", surface.area},
                     {"volume_m3", surface.volume}};
  json["tetrahedra"] = {{"nodes", r.nodes},
                        {"tetrahedra", r.tetrahedra},
                        {"cell_m", r.cell},
                        {"volume_m3", r.quality.volume},
                        {"volume_error", r.volume_error()},
                        {"inverted", r.quality.inverted},
                        {"min_dihedral_deg", r.quality.min_dihedral_deg},
                        {"max_dihedral_deg", r.quality.max_dihedral_deg},
                        {"min_dihedral_histogram_5deg", r.dihedral_histogram}};
  if (r.element == physics::Element::quadratic) json["tetrahedra"]["element"] = "quadratic";
  for (const LabelReport& label : r.labels) {
    json["labels"].push_back({{"label", label.label},
                              {"tissue", label.tissue},
                              {"volume_m3", label.volume},
                              {"tetrahedra", label.tetrahedra}});
  }
  json["notes"] = r.notes;
  // Names of parts come from files and need not be UTF-8.
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string report_text(const ImportedOrgan& organ, const OrganParts& parts) {
  const ImportReport& r = organ.report;
  std::string text = fmt::format("{}\n{}\n", organ.id, std::string(organ.id.size(), '='));
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "from           {} ({})\n", file_names(parts), parts.file->format);
  for (const std::string& assumption : parts.file->assumptions)
    fmt::format_to(out, "               {}\n", assumption);
  std::string names;
  for (const SourcePart* part : parts.parts) names += (names.empty() ? "" : ", ") + part->name;
  fmt::format_to(out, "parts          {}: {}\n", r.parts, names);
  if (r.from != SolidFrom::labels) {
    fmt::format_to(out, "read           {} triangles, {} after welding and cleaning, {} component(s)\n",
                   r.triangles_read, r.triangles, r.components);
    fmt::format_to(out, "               {} open edges, {} edges of three or more triangles\n", r.boundary_edges,
                   r.non_manifold_edges);
  }
  fmt::format_to(out, "inside         from {}", name_of(r.from));
  if (r.gap > 0) fmt::format_to(out, ", openings up to {:.2g} mm closed", r.gap * 1e3);
  fmt::format_to(out, "\nvolume         {:.4g} ml; tetrahedra {:.4g} ml ({:+.2f} %)\n", r.volume * 1e6,
                 r.quality.volume * 1e6, 100 * r.volume_error());
  print_pieces(out, r);
  fmt::format_to(out, "tetrahedra     {} with {} nodes, dihedral angles {:.1f} to {:.1f} degrees, {} inverted\n",
                 r.tetrahedra, r.nodes, r.quality.min_dihedral_deg, r.quality.max_dihedral_deg, r.quality.inverted);
  if (r.element == physics::Element::quadratic) {
    fmt::format_to(out, "               eight in a row are one element of ten nodes\n");
  }
  for (const LabelReport& label : r.labels) {
    fmt::format_to(out, "{:<14} {} {}: {:.4g} ml, {} tetrahedra\n", &label == r.labels.data() ? "labels" : "",
                   label.label, label.tissue, label.volume * 1e6, label.tetrahedra);
  }
  fmt::format_to(out, "\nsmallest dihedral angle of a tetrahedron\n");
  const int most = *std::max_element(r.dihedral_histogram.begin(), r.dihedral_histogram.end());
  for (std::size_t bin = 0; bin < r.dihedral_histogram.size(); ++bin) {
    const int count = r.dihedral_histogram[bin];
    const std::size_t length = most > 0
                                   ? (50 * static_cast<std::size_t>(count) + static_cast<std::size_t>(most) - 1) /
                                         static_cast<std::size_t>(most)
                                   : 0;
    fmt::format_to(out, "{:>3}-{:<3} {:>7} {}\n", 5 * bin, 5 * bin + 5, count, std::string(length, '#'));
  }
  if (!r.notes.empty()) text += "\nnotes\n";
  for (const std::string& note : r.notes) fmt::format_to(out, "- {}\n", note);
  return text;
}

}  // namespace stylet::import
