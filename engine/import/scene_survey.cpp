#include "engine/import/scene_survey.h"

#include "engine/mesh/solid.h"
#include "engine/readers/label_volume.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace stylet::import {
namespace {

constexpr double kVoxel = 0.002;      // m
constexpr double kMostVoxels = 60e6;  // the spacing grows until they fit
constexpr double kStep = 0.25e-3;     // m, along the path

bool is_closed(const gltf::AnnotatedSurface& surface) {
  return surface.role != "visual";
}

bool is_wanted(const gltf::AnnotatedSurface& a, const gltf::AnnotatedSurface& b) {
  return !a.body.empty() && a.body == b.body;
}

}  // namespace

std::vector<Overlap> find_overlaps(std::span<const gltf::AnnotatedSurface> surfaces) {
  Eigen::AlignedBox3d box;
  for (const gltf::AnnotatedSurface& surface : surfaces) {
    if (!is_closed(surface)) continue;
    for (const Eigen::Vector3d& v : surface.mesh.vertices) box.extend(v);
  }
  if (box.isEmpty()) return {};
  double spacing = kVoxel;
  content::LabelVolume grid;
  for (;; spacing *= 1.1) {
    grid.size = ((box.sizes() / spacing).array().ceil() + 3).cast<int>();
    if (grid.size.cast<double>().prod() <= kMostVoxels) break;
  }
  grid.spacing = static_cast<float>(spacing);
  grid.origin = (box.min().array() - spacing).matrix().cast<float>();
  const auto nx = static_cast<std::size_t>(grid.size.x());
  std::vector<std::int16_t> owner(
      nx * static_cast<std::size_t>(grid.size.y()) * static_cast<std::size_t>(grid.size.z()), -1);

  std::vector<std::size_t> voxels(surfaces.size(), 0);
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> shared;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    if (!is_closed(surfaces[s])) continue;
    const auto crossings = readers::row_crossings(surfaces[s].mesh, grid);
    for (std::size_t c = 0; c + 1 < crossings.size();) {
      if (crossings[c].row != crossings[c + 1].row) {
        ++c;
        continue;
      }
      const auto index = [&](float x) {
        const double i = std::ceil((static_cast<double>(x) - grid.origin.x()) / grid.spacing);
        return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(nx)));
      };
      const std::size_t row = crossings[c].row * nx;
      for (std::size_t i = row + index(crossings[c].x); i < row + index(crossings[c + 1].x); ++i) {
        ++voxels[s];
        if (owner[i] >= 0) ++shared[{static_cast<std::size_t>(owner[i]), s}];
        owner[i] = static_cast<std::int16_t>(s);
      }
      c += 2;
    }
  }

  std::vector<Overlap> overlaps;
  const double voxel = std::pow(static_cast<double>(grid.spacing), 3);
  for (const auto& [pair, count] : shared) {
    const auto [below, above] = pair;
    if (is_wanted(surfaces[below], surfaces[above])) continue;
    overlaps.push_back(
        {.gives_way = surfaces[below].name,
         .counts = surfaces[above].name,
         .volume = static_cast<double>(count) * voxel,
         .share = static_cast<double>(count) / static_cast<double>(std::min(voxels[below], voxels[above]))});
  }
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const Overlap& a, const Overlap& b) { return a.volume > b.volume; });
  return overlaps;
}

std::vector<PathPiece> find_path(std::span<const gltf::AnnotatedSurface> surfaces, const Eigen::Vector3d& entry,
                                 const Eigen::Vector3d& target) {
  std::vector<PathPiece> path;
  const double length = (target - entry).norm();
  const Eigen::Vector3d direction = (target - entry) / length;
  const Eigen::AlignedBox3d line(entry.cwiseMin(target), entry.cwiseMax(target));
  for (const gltf::AnnotatedSurface& surface : surfaces) {
    if (!is_closed(surface)) continue;
    const mesh::Solid solid(surface.mesh);
    if (!solid.bounds().intersects(line)) continue;
    bool inside = false;
    for (double s = 0; s <= length; s += kStep) {
      const Eigen::Vector3d x = entry + s * direction;
      const bool now = solid.bounds().contains(x) && solid.contains(x);
      if (now && !inside) path.push_back({.organ = surface.name, .from = s, .to = s});
      if (now) path.back().to = s;
      inside = now;
    }
  }
  std::stable_sort(path.begin(), path.end(), [](const PathPiece& a, const PathPiece& b) { return a.from < b.from; });
  return path;
}

Eigen::Vector3d centre_of(const mesh::TriangleMesh& surface) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto& v = surface.vertices;
    const double tet = v[a].dot(v[b].cross(v[c])) / 6;
    volume += tet;
    moment += tet * 0.25 * (v[a] + v[b] + v[c]);
  }
  return moment / volume;
}

}  // namespace stylet::import
