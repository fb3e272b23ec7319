#include "engine/import/scene_placement.h"

#include "engine/content/probe_placement.h"
#include "engine/files/error.h"
#include "engine/mesh/surface_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::import {
namespace {

using files::ContentError;

constexpr double kFarFromSkin = 0.015;  // m: farther away a point was not meant to be on it
constexpr double kRimCells = 1.2;       // of the tetrahedra's cell: nodes nearer to the rim are held
constexpr double kCutHeld = 0.006;      // m: nodes of an organ nearer to a cut are held
constexpr int kRimPlanes = 16;          // of a ball's rim
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMostTilt = 20 * kDegree;  // of the probe's axis against the skin's normal

/// The point of the skin next to one that is meant to be on it.
mesh::Solid::Nearest snap(const SideFile& side, const Body& body, const std::string& pointer,
                          const Eigen::Vector3d& point) {
  const mesh::Solid::Nearest hit = body.on_skin(point);
  if (hit.distance > kFarFromSkin) {
    throw ContentError(
        fmt::format("{}:{}: lies {:.0f} mm from the skin; the nearest point on it is [{:.4f}, {:.4f}, "
                    "{:.4f}]",
                    side.path.string(), pointer, hit.distance * 1e3, hit.point.x(), hit.point.y(), hit.point.z()));
  }
  return hit;
}

/// Edge of a wall's lattice, m, where only its number of nodes is given: two nodes a cell inside, nearly as many at
/// the surface.
double cell_of(const SideWall& wall, const mesh::TriangleMesh& surface) {
  if (wall.cell > 0) return wall.cell;
  return std::cbrt(3.5 * mesh::inspect(surface).volume / wall.target_nodes);
}

Hold beyond(const ScanCut& cut, double reach) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[cut.axis] = cut.side;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  point[cut.axis] = cut.at - cut.side * reach;
  Hold hold;
  hold.plane.emplace(normal, point);
  return hold;
}

void hold_near(const std::vector<std::string>& organs, double within, std::vector<Hold>& holds) {
  if (organs.empty()) return;
  Hold hold;
  hold.near = organs;
  hold.within = within;
  holds.push_back(hold);
}

}  // namespace

void place_on_skin(const SideFile& side, const Body& body, ImportedScene& scene) {
  const SideScenario& scenario = *side.scenario;
  const mesh::Solid::Nearest entry = snap(side, body, scenario.pointer + "/entry", *scenario.entry);
  scene.entry = entry.point;
  scene.outward = entry.normal;
  const Eigen::Vector3d needle = scene.target - scene.entry;
  if (needle.norm() < 1e-3 || std::abs(needle.normalized().y()) > 0.98) {
    throw ContentError(
        fmt::format("{}:{}/entry: the needle would run along the body or nowhere; choose an entry at "
                    "the side of the target or in front of it",
                    side.path.string(), scenario.pointer));
  }

  const std::string pointer = scenario.pointer + "/probe/at";
  const mesh::Solid::Nearest probe = snap(side, body, pointer, *scenario.probe.at);
  // The image holds the needle: its plane goes through the probe, the entry and what is looked at.
  const Eigen::Vector3d seen = scenario.probe.look_at.value_or(scene.target);
  if ((scene.entry - probe.point).normalized().cross((seen - probe.point).normalized()).norm() < 0.1) {
    throw ContentError(
        fmt::format("{}:{}: looks along the needle; move it away from the entry", side.path.string(), pointer));
  }
  scene.probe = content::probe_on_skin(probe.point, probe.normal, seen, scene.entry);
  const Eigen::Vector3d axis = scene.probe.orientation * Eigen::Vector3d::UnitZ();
  const double tilt = std::acos(std::clamp(-axis.dot(probe.normal), -1.0, 1.0));
  if (tilt > kMostTilt) {
    scene.warnings.push_back(
        fmt::format("the probe is tilted by {:.0f} degrees against the skin: a part of its face "
                    "is off it; move it to where needle and target lie in a plane across the skin",
                    tilt * 180 / std::numbers::pi));
  }
}

std::vector<Hold> holds_of_wall(const SideFile& side, const Body& body, const ImportedScene& scene,
                                const mesh::TriangleMesh& surface) {
  const SideWall& wall = side.scenario->wall;
  const double reach = kRimCells * cell_of(wall, surface);
  std::vector<Hold> holds;
  hold_near(wall.held_by, wall.held_within, holds);
  if (wall.box) {
    Hold hold;
    hold.outside_box.emplace(wall.box->min().array() + reach, wall.box->max().array() - reach);
    holds.push_back(hold);
  } else {
    // The rim of the ball by planes round the skin's normal, each as far out as the rim lies there.
    const Eigen::Vector3d across = scene.outward.unitOrthogonal();
    const Eigen::Vector3d along = scene.outward.cross(across);
    for (int i = 0; i < kRimPlanes; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRimPlanes;
      const Eigen::Vector3d out = std::cos(angle) * across + std::sin(angle) * along;
      double nearest = 1e9;
      for (const Eigen::Vector3d& v : surface.vertices) {
        const Eigen::Vector3d x = v - scene.entry;
        const double aside = out.dot(x - x.dot(scene.outward) * scene.outward);
        const double radius = (x - x.dot(scene.outward) * scene.outward).norm();
        if (x.norm() < wall.radius - 1e-3 || aside < radius * std::cos(std::numbers::pi / kRimPlanes)) continue;
        nearest = std::min(nearest, aside);
      }
      if (nearest > wall.radius) continue;  // no rim: a cut of the scan is nearer
      Hold hold;
      hold.plane.emplace(out, scene.entry + (nearest - reach) * out);
      holds.push_back(hold);
    }
  }
  for (const ScanCut& cut : body.cuts()) {
    const bool reached = std::any_of(surface.vertices.begin(), surface.vertices.end(),
                                     [&](const Eigen::Vector3d& v) { return cut.beyond(v) > -reach; });
    if (reached) holds.push_back(beyond(cut, reach));
  }
  return holds;
}

std::vector<Hold> holds_of_organ(const SideOrgan& organ, const std::vector<ScanCut>& cuts,
                                 const mesh::TriangleMesh& surface) {
  std::vector<Hold> holds;
  hold_near(organ.held_by, organ.held_within, holds);
  if (organ.held_back > 0) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& v : surface.vertices) box.extend(v);
    Hold hold;
    hold.plane.emplace(-Eigen::Vector3d::UnitZ(),
                       Eigen::Vector3d(0, 0, box.min().z() + organ.held_back * box.sizes().z()));
    holds.push_back(hold);
  }
  for (const ScanCut& cut : cuts) {
    if (area_on(cut, surface) > 0) holds.push_back(beyond(cut, kCutHeld));
  }
  return holds;
}

mesh::TriangleMesh skin_outside_field(const SideFile& side, const Body& body, const ImportedScene& scene) {
  const mesh::TriangleMesh& whole = body.solid().surface();
  mesh::TriangleMesh skin;
  std::vector<std::uint32_t> place(whole.vertices.size(), ~0u);
  for (const auto& t : whole.triangles) {
    const bool in_field = std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
      return field_distance(side.scenario->wall, scene.entry, body.cuts(), whole.vertices[v]) < 0;
    });
    if (in_field) continue;
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint32_t& at = place[t[c]];
      if (at == ~0u) {
        at = static_cast<std::uint32_t>(skin.vertices.size());
        skin.vertices.push_back(whole.vertices[t[c]]);
      }
      triangle[c] = at;
    }
    skin.triangles.push_back(triangle);
  }
  return skin;
}

}  // namespace stylet::import
