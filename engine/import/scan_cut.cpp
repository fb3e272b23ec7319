#include "engine/import/scan_cut.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::import {
namespace {

using mesh::TriangleMesh;
using Triangle = std::array<std::uint32_t, 3>;

constexpr double kFlat = 0.5e-3;     // m, from the plane
constexpr double kFacing = 0.98;     // cosine between a flat face's normal and the axis: 11 degrees
constexpr double kLeastShare = 0.1;  // of the box's face
constexpr double kRim = 6e-3;        // m: smoothing rounds the edge between the skin and the cut
constexpr double kRimFacing = 0.5;   // cosine

Eigen::Vector3d area_normal(const TriangleMesh& mesh, const Triangle& t) {
  const auto& v = mesh.vertices;
  return 0.5 * (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
}

/// Farthest of the corners from the plane, m.
double distance(const ScanCut& cut, const TriangleMesh& mesh, const Triangle& t) {
  double farthest = 0;
  for (const std::uint32_t v : t) farthest = std::max(farthest, std::abs(cut.beyond(mesh.vertices[v])));
  return farthest;
}

}  // namespace

std::string ScanCut::name() const {
  static constexpr std::array kNames{"the right", "the left", "the feet", "the head", "the back", "the front"};
  return kNames[2 * axis + (side > 0 ? 1 : 0)];
}

double area_on(const ScanCut& cut, const TriangleMesh& surface) {
  double area = 0;
  for (const Triangle& t : surface.triangles) {
    if (distance(cut, surface, t) > kFlat) continue;
    const Eigen::Vector3d normal = area_normal(surface, t);
    if (cut.side * normal[cut.axis] > kFacing * normal.norm()) area += normal.norm();
  }
  return area;
}

std::vector<ScanCut> find_cuts(const TriangleMesh& body) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : body.vertices) box.extend(v);
  std::vector<ScanCut> cuts;
  if (box.isEmpty()) return cuts;
  for (int axis = 0; axis < 3; ++axis) {
    const double face = box.sizes()[(axis + 1) % 3] * box.sizes()[(axis + 2) % 3];
    for (const double side : {-1.0, 1.0}) {
      ScanCut cut{.axis = axis, .side = side, .at = side > 0 ? box.max()[axis] : box.min()[axis], .area = 0};
      cut.area = area_on(cut, body);
      if (cut.area >= kLeastShare * face) cuts.push_back(cut);
    }
  }
  return cuts;
}

TriangleMesh skin_of(const TriangleMesh& body, const std::vector<ScanCut>& cuts) {
  TriangleMesh skin{.vertices = body.vertices, .triangles = {}};
  for (const Triangle& t : body.triangles) {
    const Eigen::Vector3d normal = area_normal(body, t);
    const bool cut_off = std::any_of(cuts.begin(), cuts.end(), [&](const ScanCut& cut) {
      return distance(cut, body, t) < kRim && cut.side * normal[cut.axis] > kRimFacing * normal.norm();
    });
    if (!cut_off) skin.triangles.push_back(t);
  }
  return skin;
}

}  // namespace stylet::import
