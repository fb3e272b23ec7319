#include "engine/import/organ_import.h"

#include "engine/files/error.h"
#include "engine/files/pulse.h"
#include "engine/import/enclosed_solid.h"
#include "engine/import/gmsh.h"
#include "engine/import/label_solid.h"
#include "engine/mesh/quadratic_mesh.h"
#include "engine/mesh/solid.h"
#include "engine/mesh/surface_mesh.h"
#include "engine/mesh/surface_pieces.h"
#include "engine/mesh/tetrahedralise.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace stylet::import {
namespace {

using files::ContentError;
using mesh::SolidShape;
using mesh::SurfaceReport;
using mesh::TriangleMesh;

// Openings tried one after the other where nothing is said, m. Sheets of real organs meet within fractions of a
// millimetre; vessels that were cut off leave holes of some millimetres.
// The last only confirms the one before it.
constexpr std::array kGaps{0.5e-3, 1e-3, 2e-3, 4e-3, 6e-3, 9e-3};
constexpr double kConfirmed = 0.1;          // of the volume, which a wider gap changes less
constexpr double kLeastWidth = 1e-3;        // m
constexpr double kFinestSpacing = 0.25e-3;  // m
constexpr double kSpacings = 250;           // of the enclosure along the diagonal of the organ, at least
constexpr double kNodes = 3e6;              // or as many of its box: finer where it is long and narrow
// Isoperimetric quotient 36 pi V^2 / A^3 of a solid: a tube has 4.5 radius/length, a wall 14 thickness^2/area.
constexpr double kLeastQuotient = 2e-3;
constexpr double kSurfaceLattice = 2e6;             // cells
constexpr int kSurfaceSteps = 3;                    // to finer ones
constexpr std::size_t kMostDistances = 40'000'000;  // for a new surface: seconds, not hours
constexpr double kDebris = 4;  // surface cells by volume; smaller bubbles of an enclosure are no pieces

struct ShapeOfOrgan {
  std::vector<SolidShape> pieces;
  TriangleMesh surface;                              // empty: to be made from the one piece there is
  std::vector<std::shared_ptr<const void>> holders;  // what the distances stand on
};

/// The solid in a closed surface, or in one of several.
void add_piece(ShapeOfOrgan& shape, const TriangleMesh& closed, const files::Pulse& pulse) {
  auto solid = std::make_shared<mesh::Solid>(closed, pulse);
  shape.pieces.push_back(
      {.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
       .box = solid->bounds(),
       .volume = mesh::inspect(closed, pulse).volume});
  shape.holders.push_back(std::move(solid));
}

TriangleMesh merged(const OrganParts& organ) {
  TriangleMesh soup;
  for (const SourcePart* part : organ.parts) append(soup, part->mesh);
  return soup;
}

std::string describe(const SurfaceReport& report) {
  return fmt::format("{} open edges, {} edges of three or more triangles", report.boundary_edges,
                     report.non_manifold_edges);
}

/// Not a wall or a sheet.
bool has_inside(const EnclosedSolid& solid) {
  if (solid.depth() < 1.5 * solid.spacing()) return false;
  const double volume = solid.volume(), area = solid.area();
  return 36 * std::numbers::pi * volume * volume > kLeastQuotient * area * area * area;
}

ShapeOfOrgan enclosed(const std::shared_ptr<const EnclosedSolid>& solid, const SurfaceReport& surface,
                      ImportReport& report) {
  report.from = SolidFrom::enclosure;
  report.gap = solid->gap();
  const std::string why = surface.closed() ? "the surface crosses or touches itself"
                                           : fmt::format("the surface is not closed ({})", describe(surface));
  report.notes.push_back(
      fmt::format("{}: what it encloses was filled, openings up to {:.2g} mm closed", why, solid->gap() * 1e3));
  return {
      .pieces = {{.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
                  .box = solid->bounds(),
                  .volume = solid->volume()}},
      .surface = {},
      .holders = {solid}};
}

/// The solid inside a dirty surface, through the smallest gap that gives one, which the next gap confirms: else a
/// part of the organ is closed and the rest still open.
ShapeOfOrgan enclose(const OrganParts& organ, const TriangleMesh& soup, const SurfaceReport& surface,
                     const ImportSettings& settings, const ImportProgress& progress, ImportReport& report) {
  const Eigen::Vector3d size = surface.bounds.sizes();
  const double finest =
      std::max(kFinestSpacing, std::min(size.norm() / kSpacings, std::cbrt((size.array() + 10e-3).prod() / kNodes)));
  std::vector<double> gaps(kGaps.begin(), kGaps.end());
  if (settings.gap) gaps = {*settings.gap};
  std::shared_ptr<const EnclosedSolid> last;
  for (const double gap : gaps) {
    if (last && gap <= last->gap()) continue;
    const std::string task = fmt::format("{}: looking for its inside, gaps of {:g} mm closed", organ.id, gap * 1e3);
    auto solid = std::make_shared<const EnclosedSolid>(soup, gap, std::min(finest, std::max(gap, 4 * kFinestSpacing)),
                                                       EnclosedSolid::Limits{}, [&] { progress(task, 0); });
    if (settings.gap && has_inside(*solid)) return enclosed(solid, surface, report);
    if (last && has_inside(*last) && std::abs(solid->volume() / last->volume() - 1) < kConfirmed) {
      return enclosed(last, surface, report);
    }
    const bool confirms_only = last && gap > 0.05 * size.norm();
    if (confirms_only) break;
    last = std::move(solid);
  }
  const std::string where = organ.parts.front()->place;
  if (surface.closed()) {
    throw ContentError(
        fmt::format("{}: {} is a double wall, not a solid: it encloses {:.3g} ml with {:.3g} cm2 of surface; add the "
                    "parts that close its inside, or give its outer surface alone",
                    where, organ.id, surface.volume * 1e6, surface.area * 1e4));
  }
  throw ContentError(
      fmt::format("{}: {} has no inside: {}; with gaps of {:.2g} mm closed it is a wall of {:.2g} mm, or still open "
                  "in places; add the parts that close it, or raise --gap",
                  where, organ.id, describe(surface), last->gap() * 1e3, 2e3 * last->volume() / last->area()));
}

std::shared_ptr<const LabelSolid> solid_of_labels(const OrganParts& organ, const ImportProgress& progress) {
  const std::string task = fmt::format("{}: distance to its voxels", organ.id);
  std::vector<int> labels;
  for (const SourcePart* part : organ.parts) labels.push_back(part->label);
  try {
    return std::make_shared<const LabelSolid>(*organ.file->image, labels, LabelSolid::kMostVoxels,
                                              [&] { progress(task, 0); });
  } catch (const ContentError& error) {
    throw ContentError(fmt::format("{}: {}: {}", organ.parts.front()->place, organ.id, error.what()));
  }
}

ShapeOfOrgan shape_of_surfaces(const OrganParts& organ, const ImportSettings& settings,
                               const ImportProgress& progress, ImportReport& report) {
  const files::Pulse pulse = [&, task = fmt::format("{}: welding {} parts", organ.id, organ.parts.size())] {
    progress(task, 0);
  };
  pulse.now();
  const TriangleMesh soup = merged(organ);
  const std::string& where = organ.parts.front()->place;
  TriangleMesh clean = mesh::clean_surface(soup, where, &report.turned, pulse);
  const SurfaceReport surface = mesh::inspect(clean, pulse);
  if (const double width = surface.bounds.sizes().maxCoeff(); width < kLeastWidth) {
    throw ContentError(fmt::format("{}: {} is {:.3g} mm wide, too small for an organ; {}", where, organ.id,
                                   width * 1e3,
                                   organ.file->format == "glTF" ? "give its node a scale" : "say its --unit"));
  }
  report.triangles_read = soup.triangles.size();
  report.triangles = clean.triangles.size();
  report.dropped = soup.triangles.size() - clean.triangles.size();
  report.boundary_edges = surface.boundary_edges;
  report.non_manifold_edges = surface.non_manifold_edges;
  report.components = surface.components;
  if (surface.closed()) report.welded_volume = surface.volume;
  if (!settings.gap) {
    try {
      const bool as_it_is = !settings.solid && surface.closed() && surface.oriented();
      TriangleMesh closed = as_it_is ? clean : mesh::solid_surface(clean, where, pulse);
      const auto outer = as_it_is ? std::optional(mesh::OuterPieces{.pieces = {std::move(closed)}})
                                  : mesh::outer_pieces(closed, pulse);
      if (outer) {
        ShapeOfOrgan shape;
        for (const TriangleMesh& piece : outer->pieces) {
          add_piece(shape, piece, pulse);
          append(shape.surface, piece);
        }
        if (outer->inner > 0) {
          report.notes.push_back(
              fmt::format("{} closed surface(s) inside another were left out: the organ is filled", outer->inner));
        } else if (report.turned > 0) {
          report.notes.push_back(
              fmt::format("{} of {} triangles faced inwards and were turned", report.turned, report.triangles));
        }
        return shape;
      }
    } catch (const ContentError& error) {
      // Not closed, pinched or a double wall: what it encloses may still be a solid.
    }
  }
  return enclose(organ, clean, surface, settings, progress, report);
}

/// The surface of the one piece there is; it may turn out to be several.
void make_new_surface(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress,
                      ShapeOfOrgan& shape) {
  const std::string task = fmt::format("{}: new surface", organ.id);
  const files::Pulse pulse = [&] { progress(task, 0); };
  const SolidShape whole = shape.pieces.front();
  // Finer where little of the box is filled, as long as the lattice is not too large.
  const Eigen::Vector3d size = whole.box.sizes();
  const double finest = std::cbrt(size.prod() / kSurfaceLattice);
  double cell = std::max(finest, std::min(size.norm(), 3.5 * std::cbrt(whole.volume)) / settings.surface_cells);
  std::size_t distances = 0;  // of all steps
  const auto surface_of = [&] {
    const mesh::SignedDistance watched = [&](const Eigen::Vector3d& x) {
      pulse(files::Pulse::kDistance);
      if (++distances > kMostDistances) {
        throw ContentError(fmt::format(
            "{}: {} takes more than {:.2g} looks at its surface, with cells of {:.3g} mm: it is long, thin "
            "or ragged; split it into parts, or leave it out",
            organ.parts.front()->place, organ.id, static_cast<double>(kMostDistances), cell * 1e3));
      }
      return whole.distance(x);
    };
    return mesh::boundary_surface(mesh::stuff(watched, whole.box, cell, 2, mesh::Parts::all, pulse), pulse).mesh;
  };
  TriangleMesh made = surface_of();
  if (organ.file->image) {  // whose volume is exact: what is a few voxels thick may need finer cells
    for (int step = 0; step < kSurfaceSteps && 0.7 * cell > finest; ++step) {
      if (std::abs(mesh::inspect(made, pulse).volume / whole.volume - 1) <= settings.volume_error) break;
      cell *= 0.7;
      made = surface_of();
    }
  }
  std::vector<TriangleMesh> surfaces = mesh::connected_pieces(made, pulse);
  std::erase_if(surfaces, [&](const TriangleMesh& piece) {
    return mesh::inspect(piece, pulse).volume < kDebris * cell * cell * cell;
  });
  if (surfaces.empty()) {
    throw ContentError(fmt::format("{}: {} is thinner than {:.2g} mm everywhere; there is nothing to fill",
                                   organ.parts.front()->place, organ.id, cell * 1e3));
  }
  for (const TriangleMesh& surface : surfaces) append(shape.surface, surface);
  if (surfaces.size() == 1) return;
  ShapeOfOrgan pieces;
  for (const TriangleMesh& surface : surfaces) add_piece(pieces, surface, pulse);
  // The shape itself, of which the new surface is an image, near that of the piece.
  const double scale = whole.volume / mesh::inspect(shape.surface, pulse).volume;
  for (SolidShape& piece : pieces.pieces) {
    piece.distance = [all = whole.distance, near = piece.distance, slack = cell / 2](const Eigen::Vector3d& x) {
      const double distance = all(x);
      return distance < 0 ? std::max(distance, near(x) - slack) : distance;
    };
    piece.box = Eigen::AlignedBox3d(piece.box.min().array() - cell, piece.box.max().array() + cell);
    piece.volume *= scale;
  }
  shape.pieces = std::move(pieces.pieces);
  shape.holders.insert(shape.holders.end(), pieces.holders.begin(), pieces.holders.end());
}

/// Fills all of `out` but its tetrahedra.
ShapeOfOrgan make_surface(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress,
                          ImportedOrgan& out) {
  out.id = organ.id;
  ImportReport& report = out.report;
  report.parts = static_cast<int>(organ.parts.size());
  ShapeOfOrgan shape;
  if (organ.file->image) {
    const std::shared_ptr<const LabelSolid> solid = solid_of_labels(organ, progress);
    report.from = SolidFrom::labels;
    shape = {
        .pieces = {{.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
                    .box = solid->bounds(),
                    .volume = solid->volume()}},
        .surface = {},
        .holders = {solid}};
    if (solid->touches_rim()) {
      report.notes.emplace_back(
          "it reaches the rim of the volume: the scan ends inside it, and it is cut off flat there");
    }
  } else {
    shape = shape_of_surfaces(organ, settings, progress, report);
  }
  for (const SolidShape& piece : shape.pieces) report.volume += piece.volume;
  if (shape.surface.triangles.empty()) {
    make_new_surface(organ, settings, progress, shape);
  }
  out.surface = shape.surface;
  return shape;
}

void note_pieces(ImportReport& report) {
  const auto& pieces = report.pieces;
  if (pieces.size() < 2) return;
  const auto left_out = static_cast<std::size_t>(
      std::count_if(pieces.begin(), pieces.end(), [](const PieceReport& piece) { return piece.tetrahedra == 0; }));
  std::string note = fmt::format("it is in {} pieces; tetrahedra fill {} of {:.3g} ml", pieces.size(),
                                 pieces.size() - left_out, report.filled_volume() * 1e6);
  if (left_out > 0) {
    note += fmt::format(", {} of {:.3g} ml together are left out: smaller than a few cells of {:.2g} mm", left_out,
                        (report.volume - report.filled_volume()) * 1e6, report.cell * 1e3);
  }
  report.notes.push_back(std::move(note));
}

// Nodes that Gmsh makes of volume/cell^3: 1.2 (a liver) to 2 (a gallbladder) measured.
constexpr double kGmshNodes = 1.5;
constexpr int kGmshSteps = 5;
constexpr double kFewCells = 4;  // that a piece holds at least, by volume

mesh::FilledPieces fill_by_gmsh(const OrganParts& organ, const TriangleMesh& surface, const ImportSettings& settings,
                                const ImportProgress& progress) {
  const std::string task = fmt::format("{}: tetrahedra by Gmsh", organ.id);
  const std::string& where = organ.parts.front()->place;
  const std::vector<TriangleMesh> pieces = mesh::connected_pieces(surface);
  const double volume = mesh::inspect(surface).volume;
  mesh::FilledPieces filled;
  const int nodes = settings.target_nodes > 0 ? settings.target_nodes : 600;
  filled.cell = settings.cell > 0 ? settings.cell : std::cbrt(kGmshNodes * volume / nodes);
  const bool search = settings.cell == 0 && settings.target_nodes == 0;
  for (int step = 0;; ++step, filled.cell *= 0.75) {
    filled.mesh = {};
    filled.volumes.clear();
    double wanted = 0, made = 0;
    for (const TriangleMesh& piece : pieces) {
      const double of_piece = mesh::inspect(piece).volume;
      filled.volumes.push_back(0);
      if (pieces.size() > 1 && of_piece < kFewCells * filled.cell * filled.cell * filled.cell) continue;
      const bool quadratic = settings.element == physics::Element::quadratic;
      physics::TetMesh mesh = gmsh_tetrahedra(
          piece, {.cell = quadratic ? 2 * filled.cell : filled.cell, .program = settings.gmsh, .where = where},
          [&] { progress(task, 0); });
      if (quadratic) {
        const mesh::Solid solid(piece);
        mesh = mesh::refined_on_surface(mesh, [&](const Eigen::Vector3d& x) { return solid.signed_distance(x); });
      }
      if (!mesh::inspect(mesh::boundary_surface(mesh).mesh).closed()) {
        throw ContentError(fmt::format("{}: the tetrahedra of Gmsh do not close; leave out --mesher gmsh", where));
      }
      filled.volumes.back() = mesh::tet_quality(mesh).volume;
      wanted += of_piece;
      made += filled.volumes.back();
      mesh::append(filled.mesh, mesh);
    }
    const double missed = std::max(wanted > 0 ? std::abs(made / wanted - 1) : 1, 1 - wanted / volume);
    if (missed <= settings.volume_error || (!search && wanted > 0)) return filled;
    if (!search || step + 1 == kGmshSteps) {
      throw ContentError(
          fmt::format("{}: with {:.3g} mm the tetrahedra of Gmsh miss {:.0f} % of the volume; leave out "
                      "--mesher gmsh",
                      where, filled.cell * 1e3, 100 * missed));
    }
  }
}

}  // namespace

ImportedOrgan import_surface(const OrganParts& organ, const ImportSettings& settings,
                             const ImportProgress& progress) {
  ImportedOrgan out;
  make_surface(organ, settings, progress, out);
  return out;
}

ImportedOrgan import_organ(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress) {
  ImportedOrgan out;
  const ShapeOfOrgan shape = make_surface(organ, settings, progress, out);
  ImportReport& report = out.report;
  const auto filling = [&](double cell, double share) {
    progress(fmt::format("{}: tetrahedra, cells of {:.3g} mm", organ.id, cell * 1e3), share);
  };
  mesh::FilledPieces filled = settings.mesher == Mesher::gmsh
                                  ? fill_by_gmsh(organ, out.surface, settings, progress)
                                  : mesh::fill_pieces(shape.pieces, {.element = settings.element,
                                                                     .cell = settings.cell,
                                                                     .target_nodes = settings.target_nodes,
                                                                     .volume_error = settings.volume_error,
                                                                     .node_tolerance = 0.05,
                                                                     .grading = settings.grading,
                                                                     .where = organ.parts.front()->place,
                                                                     .progress = filling});
  out.mesh = std::move(filled.mesh);
  report.cell = filled.cell;
  for (std::size_t p = 0; p < shape.pieces.size(); ++p) {
    report.pieces.push_back({.volume = shape.pieces[p].volume, .tetrahedra = filled.volumes[p]});
  }
  note_pieces(report);
  if (settings.grading) {
    const Eigen::Vector3d target = settings.grading->target * 1e3;
    report.notes.push_back(
        fmt::format("({:.1f}, {:.1f}, {:.1f}) mm {}", target.x(), target.y(), target.z(),
                    filled.graded ? fmt::format("has tetrahedra {:g} times finer around it", settings.grading->factor)
                                  : "lies outside it: its tetrahedra are not graded"));
  }
  report.nodes = out.mesh.nodes.size();
  report.tetrahedra = out.mesh.tets.size();
  report.element = settings.element;
  report.quality = mesh::tet_quality(out.mesh);
  report.dihedral_histogram.assign(15, 0);
  for (const auto& tet : out.mesh.tets) {
    const auto corner = [&](std::size_t c) { return out.mesh.nodes[tet[c]]; };
    const double angle =
        mesh::dihedral_range(corner(0), corner(1), corner(2), corner(3)).min * 180 / std::numbers::pi;
    ++report.dihedral_histogram[static_cast<std::size_t>(std::clamp(angle / 5, 0.0, 14.0))];
  }
  return out;
}

}  // namespace stylet::import
