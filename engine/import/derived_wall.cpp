#include "engine/import/derived_wall.h"

#include "engine/files/error.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/tet_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::import {
namespace {

using files::ContentError;
using mesh::Solid;

constexpr double kShortOfCut = 0.004;   // m: the skin is rounded off where the scan ends
constexpr double kSurfaceCell = 0.004;  // m, of the surfaces: about the triangles of a segmented scan
constexpr int kSmoothing = 2;           // passes

}  // namespace

Body::Body(const mesh::TriangleMesh& surface)
    : cuts_(find_cuts(surface)), solid_(surface), skin_(skin_of(surface, cuts_)) {}

double Body::depth(const Eigen::Vector3d& x) const {
  const Solid::Nearest hit = skin_.nearest(x);
  return (x - hit.point).dot(hit.normal) < 0 ? hit.distance : -hit.distance;
}

double field_distance(const SideWall& wall, const Eigen::Vector3d& entry, const std::vector<ScanCut>& cuts,
                      const Eigen::Vector3d& x) {
  double distance = 0;
  if (wall.box) {
    distance = std::max((wall.box->min() - x).maxCoeff(), (x - wall.box->max()).maxCoeff());
  } else {
    distance = (x - entry).norm() - wall.radius;
  }
  for (const ScanCut& cut : cuts) distance = std::max(distance, cut.beyond(x) + kShortOfCut);
  return distance;
}

std::vector<WallSurface> derive_wall(const SideWall& wall, const Eigen::Vector3d& entry, const Body& body,
                                     const std::vector<const Solid*>& inside, const std::string& place,
                                     const files::Pulse& pulse) {
  const Eigen::AlignedBox3d field = wall.box ? *wall.box
                                             : Eigen::AlignedBox3d(entry - Eigen::Vector3d::Constant(wall.radius),
                                                                   entry + Eigen::Vector3d::Constant(wall.radius));
  const Eigen::AlignedBox3d box = field.intersection(body.solid().bounds());
  if (box.isEmpty()) throw ContentError(place + ": its field does not meet the body; move it to the entry");

  std::vector<WallSurface> surfaces;
  double from = 0;
  for (const WallLayer& layer : wall.layers) {
    const auto distance = [&](const Eigen::Vector3d& x) {
      pulse(files::Pulse::kDistance);
      const double outside = field_distance(wall, entry, body.cuts(), x);
      if (outside > 2 * kSurfaceCell) return outside;  // saves the dear ones
      const double depth = body.depth(x);
      double d = std::max({outside, from - depth, depth - wall.depth});
      for (const Solid* organ : inside) {
        // No nearer than its box: most organs are far.
        if (wall.clearance - organ->bounds().exteriorDistance(x) <= d) continue;
        d = std::max(d, wall.clearance - organ->signed_distance(x));
      }
      return d;
    };
    WallSurface made{.tissue = layer.tissue,
                     .surface = mesh::boundary_surface(
                                    mesh::stuff(distance, box, kSurfaceCell, kSmoothing, mesh::Parts::largest, pulse))
                                    .mesh,
                     .inner_from = from};
    if (made.surface.triangles.empty()) {
      throw ContentError(
          fmt::format("{}: nothing of the body lies between {:.3g} and {:.3g} mm below the skin in its "
                      "field, outside the organs; widen the field or move it",
                      place, from * 1e3, wall.depth * 1e3));
    }
    surfaces.push_back(std::move(made));
    from += layer.thickness;
  }
  return surfaces;
}

}  // namespace stylet::import
