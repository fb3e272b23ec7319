#include "engine/import/organ_import.h"

#include "engine/content/error.h"
#include "engine/content/solid.h"
#include "engine/content/surface_mesh.h"
#include "engine/content/tetrahedralise.h"
#include "engine/import/enclosed_solid.h"
#include "engine/import/label_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace stylet::import {
namespace {

using content::ContentError;
using content::SolidShape;
using content::SurfaceReport;
using content::TriangleMesh;

// Openings tried one after the other where nothing is said, m. Sheets of real organs meet within fractions of a
// millimetre; vessels that were cut off leave holes of some millimetres.
constexpr std::array kGaps{0.5e-3, 1e-3, 2e-3, 4e-3, 6e-3};
constexpr double kFinestSpacing = 0.25e-3;  // m
constexpr double kSpacings = 250;           // of the enclosure along the diagonal of the organ, at least
// A solid is deeper than this share of its box's diagonal; walls and sheets are not.
constexpr double kLeastDepth = 0.012;

struct ShapeOfOrgan {
  SolidShape shape;
  TriangleMesh surface;                // empty: to be made from the shape
  std::shared_ptr<const void> holder;  // what the distance stands on
};

TriangleMesh merged(const OrganParts& organ) {
  TriangleMesh soup;
  for (const SourcePart* part : organ.parts) append(soup, part->mesh);
  return soup;
}

std::string describe(const SurfaceReport& report) {
  return fmt::format("{} open edges, {} edges of three or more triangles", report.boundary_edges,
                     report.non_manifold_edges);
}

/// The solid inside a dirty surface, through the smallest gap that gives one.
ShapeOfOrgan enclose(const OrganParts& organ, const TriangleMesh& soup, const SurfaceReport& surface,
                     const ImportSettings& settings, const ImportProgress& progress, ImportReport& report) {
  const double diagonal = surface.bounds.sizes().norm();
  std::vector<double> gaps(kGaps.begin(), kGaps.end());
  if (settings.gap) gaps = {*settings.gap};
  double deepest = 0, widest = 0;
  for (const double gap : gaps) {
    if (!settings.gap && gap > 0.05 * diagonal) break;
    progress(fmt::format("{}: looking for its inside, gaps of {:g} mm closed", organ.id, gap * 1e3));
    const double spacing =
        std::min(std::max(diagonal / kSpacings, kFinestSpacing), std::max(gap, 4 * kFinestSpacing));
    auto solid = std::make_shared<EnclosedSolid>(soup, gap, spacing);
    deepest = std::max(deepest, solid->depth());
    widest = std::max(widest, solid->gap());
    if (solid->depth() < kLeastDepth * diagonal) continue;
    report.from = SolidFrom::enclosure;
    report.gap = solid->gap();
    report.notes.push_back(fmt::format("the surface is not closed ({}); openings up to {:.2g} mm were closed",
                                       describe(surface), solid->gap() * 1e3));
    return {
        .shape = {.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
                  .box = solid->bounds(),
                  .volume = solid->volume()},
        .surface = {},
        .holder = solid};
  }
  const std::string where = organ.parts.front()->place;
  if (surface.closed()) {
    throw ContentError(
        fmt::format("{}: {} is a double wall, not a solid: it encloses {:.3g} ml with {:.3g} cm2 of surface; add the "
                    "parts that close its inside, or give its outer surface alone",
                    where, organ.id, surface.volume * 1e6, surface.area * 1e4));
  }
  throw ContentError(fmt::format(
      "{}: {} has no inside: {}; deepest point {:.2g} mm from outside with gaps of {:.2g} mm closed; add the "
      "parts that close it, or raise --gap",
      where, organ.id, describe(surface), deepest * 1e3, widest * 1e3));
}

std::shared_ptr<const LabelSolid> solid_of_labels(const OrganParts& organ) {
  std::vector<int> labels;
  for (const SourcePart* part : organ.parts) labels.push_back(part->label);
  try {
    return std::make_shared<const LabelSolid>(*organ.file->image, labels);
  } catch (const ContentError& error) {
    throw ContentError(fmt::format("{}: {}: {}", organ.parts.front()->place, organ.id, error.what()));
  }
}

ShapeOfOrgan shape_of_surfaces(const OrganParts& organ, const ImportSettings& settings,
                               const ImportProgress& progress, ImportReport& report) {
  progress(fmt::format("{}: welding {} parts", organ.id, organ.parts.size()));
  const TriangleMesh soup = merged(organ);
  const std::string& where = organ.parts.front()->place;
  TriangleMesh clean = content::clean_surface(soup, where);
  const SurfaceReport surface = content::inspect(clean);
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
      TriangleMesh closed = as_it_is ? clean : content::solid_surface(clean, where);
      report.volume = content::inspect(closed).volume;
      auto solid = std::make_shared<content::Solid>(closed);
      return {
          .shape = {.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
                    .box = solid->bounds(),
                    .volume = report.volume},
          .surface = std::move(closed),
          .holder = solid};
    } catch (const ContentError& error) {
      // Not closed, pinched or a double wall: what it encloses may still be a solid.
    }
  }
  return enclose(organ, clean, surface, settings, progress, report);
}

/// Fills all of `out` but its tetrahedra.
ShapeOfOrgan make_surface(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress,
                          ImportedOrgan& out) {
  out.id = organ.id;
  ImportReport& report = out.report;
  report.parts = static_cast<int>(organ.parts.size());
  ShapeOfOrgan shape;
  if (organ.file->image) {
    progress(fmt::format("{}: distance to its voxels", organ.id));
    const std::shared_ptr<const LabelSolid> solid = solid_of_labels(organ);
    report.from = SolidFrom::labels;
    shape = {
        .shape = {.distance = [solid = solid.get()](const Eigen::Vector3d& x) { return solid->signed_distance(x); },
                  .box = solid->bounds(),
                  .volume = solid->volume()},
        .surface = {},
        .holder = solid};
    if (solid->touches_rim()) {
      report.notes.emplace_back(
          "it reaches the rim of the volume: the scan ends inside it, and it is cut off flat there");
    }
  } else {
    shape = shape_of_surfaces(organ, settings, progress, report);
  }
  report.volume = shape.shape.volume;

  if (!shape.surface.triangles.empty()) {
    out.surface = std::move(shape.surface);
  } else {
    progress(fmt::format("{}: new surface", organ.id));
    const double cell = shape.shape.box.sizes().norm() / settings.surface_cells;
    out.surface = content::boundary_surface(content::stuff(shape.shape.distance, shape.shape.box, cell, 2)).mesh;
    if (out.surface.triangles.empty()) {
      throw ContentError(fmt::format("{}: {} is thinner than {:.2g} mm everywhere; there is nothing to fill",
                                     organ.parts.front()->place, organ.id, cell * 1e3));
    }
  }
  return shape;
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
  progress(fmt::format("{}: tetrahedra", organ.id));
  out.mesh = content::tetrahedralise(shape.shape, {.cell = settings.cell,
                                                   .target_nodes = settings.target_nodes,
                                                   .volume_error = settings.volume_error,
                                                   .node_tolerance = 0.05,
                                                   .where = organ.parts.front()->place});
  report.nodes = out.mesh.nodes.size();
  report.tetrahedra = out.mesh.tets.size();
  report.quality = content::tet_quality(out.mesh);
  report.dihedral_histogram.assign(15, 0);
  for (const auto& tet : out.mesh.tets) {
    const auto corner = [&](std::size_t c) { return out.mesh.nodes[static_cast<std::size_t>(tet[c])]; };
    const double angle =
        content::dihedral_range(corner(0), corner(1), corner(2), corner(3)).min * 180 / std::numbers::pi;
    ++report.dihedral_histogram[static_cast<std::size_t>(std::clamp(angle / 5, 0.0, 14.0))];
  }
  return out;
}

}  // namespace stylet::import
