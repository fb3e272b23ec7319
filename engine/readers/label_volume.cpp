#include "engine/readers/label_volume.h"

#include "engine/readers/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::readers {
namespace {

/// Rows are shifted by these shares of a voxel, so that no vertex or edge of a modelled surface lies exactly on one.
constexpr double kShiftY = 1.37e-5;
constexpr double kShiftZ = 2.11e-5;

/// Twice the signed area of (a, b, p) in the yz plane. The edge is always taken from its smaller to its larger
/// vertex, so that both triangles at an edge get the same number and a row passes exactly one of them.
double edge_side(const mesh::TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, double y, double z) {
  const double sign = a < b ? 1 : -1;
  if (a > b) std::swap(a, b);
  const Eigen::Vector3d& p = mesh.vertices[a];
  const Eigen::Vector3d& q = mesh.vertices[b];
  return sign * ((q.y() - p.y()) * (z - p.z()) - (q.z() - p.z()) * (y - p.y()));
}

int first_row(double low, double origin, double spacing) {
  return static_cast<int>(std::ceil((low - origin) / spacing - 1e-3));
}

void fill_behind(content::LabelVolume& volume, const std::vector<bool>& wall, const LabelFiller& filler) {
  const Eigen::Vector3i size = volume.size;
  const std::array<std::size_t, 3> step{1, static_cast<std::size_t>(size.x()),
                                        static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y())};
  const int axis = filler.axis;
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const std::size_t along = step[axis];
  for (int j = 0; j < size[v]; ++j) {
    for (int i = 0; i < size[u]; ++i) {
      const std::size_t start = static_cast<std::size_t>(i) * step[u] + static_cast<std::size_t>(j) * step[v];
      bool behind = false;
      for (int k = 0; k < size[axis]; ++k) {
        const int from_front = filler.positive ? size[axis] - 1 - k : k;
        const std::size_t voxel = start + static_cast<std::size_t>(from_front) * along;
        if (wall[voxel]) {
          behind = true;
        } else if (behind && volume.labels[voxel] == 0) {
          volume.labels[voxel] = filler.label;
        }
      }
    }
  }
}

}  // namespace

std::vector<RowCrossing> row_crossings(const mesh::TriangleMesh& surface, const content::LabelVolume& volume) {
  const double spacing = volume.spacing;
  const double y0 = volume.origin.y() + kShiftY * spacing;
  const double z0 = volume.origin.z() + kShiftZ * spacing;
  std::vector<RowCrossing> crossings;
  for (const auto& [a, b, c] : surface.triangles) {
    const Eigen::Vector3d& pa = surface.vertices[a];
    const Eigen::Vector3d& pb = surface.vertices[b];
    const Eigen::Vector3d& pc = surface.vertices[c];
    const Eigen::Vector3d low = pa.cwiseMin(pb).cwiseMin(pc);
    const Eigen::Vector3d high = pa.cwiseMax(pb).cwiseMax(pc);
    const int j0 = std::max(0, first_row(low.y(), y0, spacing));
    const int k0 = std::max(0, first_row(low.z(), z0, spacing));
    for (int k = k0; k < volume.size.z() && z0 + k * spacing <= high.z(); ++k) {
      for (int j = j0; j < volume.size.y() && y0 + j * spacing <= high.y(); ++j) {
        const double y = y0 + j * spacing;
        const double z = z0 + k * spacing;
        const double wa = edge_side(surface, b, c, y, z);
        const double wb = edge_side(surface, c, a, y, z);
        const double wc = edge_side(surface, a, b, y, z);
        const bool inside = (wa > 0 && wb > 0 && wc > 0) || (wa < 0 && wb < 0 && wc < 0);
        if (!inside) continue;
        const double x = (wa * pa.x() + wb * pb.x() + wc * pc.x()) / (wa + wb + wc);
        crossings.push_back({static_cast<std::uint32_t>(k * volume.size.y() + j), static_cast<float>(x)});
      }
    }
  }
  std::sort(crossings.begin(), crossings.end(),
            [](const RowCrossing& l, const RowCrossing& r) { return l.row != r.row ? l.row < r.row : l.x < r.x; });
  return crossings;
}

namespace {

/// Voxels of a row inside a solid.
struct Run {
  std::size_t first, end;
};

/// Where a solid is laid over what was there: voxels near its surface learn how far away the tissue changes. Before
/// its labels are written.
void lay_edges(content::LabelVolume& volume, const mesh::TriangleMesh& surface, std::uint8_t label,
               const std::vector<Run>& runs) {
  SurfaceDistance near = surface_distance(surface, volume);
  const Eigen::Vector3i end = near.low + near.size;
  const std::size_t nx = static_cast<std::size_t>(volume.size.x());
  for (const Run& run : runs) {
    const int y = static_cast<int>(run.first / nx % volume.size.y());
    const int z = static_cast<int>(run.first / nx / volume.size.y());
    for (std::size_t i = run.first; i < run.end; ++i) {
      // A solid that is not closed may have runs outside the box of its surface.
      const Eigen::Vector3i v(static_cast<int>(i % nx), y, z);
      if ((v.array() < near.low.array()).any() || (v.array() >= end.array()).any()) continue;
      std::uint8_t& steps = near.steps[near.at(v.x(), v.y(), v.z())];
      std::uint8_t& edge = volume.edges[i];
      edge = volume.labels[i] == label ? std::max(edge, steps) : steps;
      steps = content::kNoEdge;  // what is left lies outside
    }
  }
  std::size_t i = 0;
  for (int z = near.low.z(); z < end.z(); ++z) {
    for (int y = near.low.y(); y < end.y(); ++y) {
      std::size_t voxel = (static_cast<std::size_t>(z) * volume.size.y() + y) * nx + near.low.x();
      for (int x = near.low.x(); x < end.x(); ++x, ++i, ++voxel) {
        if (volume.labels[voxel] != label) volume.edges[voxel] = std::min(volume.edges[voxel], near.steps[i]);
      }
    }
  }
}

}  // namespace

content::LabelVolume voxelise(std::span<const LabelledSolid> solids, double spacing,
                              const std::optional<LabelFiller>& filler, LabelEdges edges) {
  Eigen::AlignedBox3d box;
  for (const LabelledSolid& solid : solids) {
    for (const auto& vertex : solid.surface->vertices) box.extend(vertex);
  }
  content::LabelVolume volume;
  if (box.isEmpty()) return volume;
  for (;; spacing *= 1.05) {
    // One empty voxel all round.
    volume.size = ((box.sizes() / spacing).array().ceil() + 3).cast<int>();
    const double voxels = volume.size.cast<double>().prod();
    if (2 * voxels <= static_cast<double>(kLabelBytes)) break;
  }
  volume.spacing = static_cast<float>(spacing);
  spacing = volume.spacing;
  volume.origin = (box.min().array() - spacing).matrix().cast<float>();
  const std::size_t count = static_cast<std::size_t>(volume.size.x()) * static_cast<std::size_t>(volume.size.y()) *
                            static_cast<std::size_t>(volume.size.z());
  volume.labels.assign(count, 0);
  volume.bodies.assign(count, -1);
  if (edges == LabelEdges::measured) volume.edges.assign(count, content::kNoEdge);
  std::vector<bool> wall(filler ? count : 0, false);

  const double x0 = volume.origin.x();
  const std::size_t nx = static_cast<std::size_t>(volume.size.x());
  for (std::size_t s = 0; s < solids.size(); ++s) {
    const bool is_wall = filler && std::find(filler->wall.begin(), filler->wall.end(), s) != filler->wall.end();
    std::vector<Run> runs;
    const auto crossings = row_crossings(*solids[s].surface, volume);
    for (std::size_t c = 0; c + 1 < crossings.size();) {
      if (crossings[c].row != crossings[c + 1].row) {
        ++c;  // odd: the row grazes something that is not closed; leave it
        continue;
      }
      const auto index = [&](float x) {
        return std::clamp(std::ceil((static_cast<double>(x) - x0) / spacing), 0.0, static_cast<double>(nx));
      };
      const std::size_t row = crossings[c].row * nx;
      runs.push_back({row + static_cast<std::size_t>(index(crossings[c].x)),
                      row + static_cast<std::size_t>(index(crossings[c + 1].x))});
      c += 2;
    }
    if (edges == LabelEdges::measured) lay_edges(volume, *solids[s].surface, solids[s].label, runs);
    for (const Run& run : runs) {
      for (std::size_t i = run.first; i < run.end; ++i) {
        volume.labels[i] = solids[s].label;
        volume.bodies[i] = solids[s].body;
        if (is_wall) wall[i] = true;
      }
    }
  }
  if (filler) fill_behind(volume, wall, *filler);
  return volume;
}

}  // namespace stylet::readers
