#include "engine/mesh/quadratic_mesh.h"

#include "engine/mesh/tet_quality.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace stylet::mesh {
namespace {

using physics::kTetsOfRefined;

constexpr double kLeastAngle = 14 * std::numbers::pi / 180;  // rad
constexpr double kLeastVolume = 0.5;                         // at a point of an element, over the mean of its four
constexpr double kFarthest = 0.25;                           // of the edge that a middle leaves
constexpr std::array<double, 4> kShares{1, 0.7, 0.4, 0.2};   // of the way to the surface

class Shaper {
public:
  Shaper(physics::TetMesh& mesh, const SignedDistance& distance) : mesh_(mesh), distance_(distance) {
    elements_of_.resize(mesh.nodes.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
      for (const int n : mesh.tets[t]) {
        std::vector<std::size_t>& elements = elements_of_[static_cast<std::size_t>(n)];
        if (elements.empty() || elements.back() != t / kTetsOfRefined) elements.push_back(t / kTetsOfRefined);
      }
    }
    for (std::size_t e = 0; e < mesh.tets.size() / kTetsOfRefined; ++e)
      least_.push_back(std::min(kLeastAngle, angle_of(e)));
  }

  /// @param length  of the edge that the node is the middle of, m
  void move(int node, double length) {
    Eigen::Vector3d& x = mesh_.nodes[static_cast<std::size_t>(node)];
    const Eigen::Vector3d before = x;
    Eigen::Vector3d to = before;
    for (int newton = 0; newton < 3; ++newton) {
      const double off = distance_(to);
      if (std::abs(off) < 1e-3 * length) break;
      to -= off * gradient(to, 0.02 * length);
    }
    if (!to.allFinite() || (to - before).norm() > kFarthest * length) {
      const double off = std::clamp(distance_(before), -kFarthest * length, kFarthest * length);
      to = before - off * gradient(before, 0.02 * length);
    }
    for (const double share : kShares) {
      x = before + share * (to - before);
      const std::vector<std::size_t>& around = elements_of_[static_cast<std::size_t>(node)];
      if (std::ranges::all_of(around, [&](std::size_t e) { return is_well_shaped(e); })) return;
    }
    x = before;
  }

private:
  Eigen::Vector3d gradient(const Eigen::Vector3d& x, double step) const {
    Eigen::Vector3d g;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
      g[axis] = distance_(x + offset) - distance_(x - offset);
    }
    return g.stableNormalized();
  }

  /// Smallest dihedral angle of an element's eight, rad.
  double angle_of(std::size_t element) const {
    double least = std::numbers::pi;
    for (std::size_t t = kTetsOfRefined * element; t < kTetsOfRefined * (element + 1); ++t) {
      const auto x = [&](std::size_t c) -> const Eigen::Vector3d& {
        return mesh_.nodes[static_cast<std::size_t>(mesh_.tets[t][c])];
      };
      least = std::min(least, dihedral_range(x(0), x(1), x(2), x(3)).min);
    }
    return least;
  }

  bool is_well_shaped(std::size_t element) const {
    if (angle_of(element) < least_[element]) return false;
    const Eigen::Array4d volume = physics::volumes_at_points(mesh_, element);
    return volume.minCoeff() > kLeastVolume * volume.mean() && volume.mean() > 0;
  }

  physics::TetMesh& mesh_;
  const SignedDistance& distance_;
  std::vector<std::vector<std::size_t>> elements_of_;  // [nodes]
  std::vector<double> least_;                          // angle that an element must keep, rad [elements]
};

}  // namespace

physics::TetMesh refined_on_surface(const physics::TetMesh& coarse, const SignedDistance& distance,
                                    const files::Pulse& pulse) {
  physics::TetMesh mesh = physics::refined(coarse);
  std::map<int, double> lengths;  // of the edges on the boundary, by their middles
  const BoundarySurface boundary = boundary_surface(mesh, pulse);
  const auto first_middle = static_cast<int>(coarse.nodes.size());
  for (const auto& triangle : boundary.mesh.triangles) {
    // Of a face in four, three have a corner of it and two middles next to that.
    for (std::size_t c = 0; c < 3; ++c) {
      const int corner = boundary.nodes[triangle[c]], next = boundary.nodes[triangle[(c + 1) % 3]];
      if ((corner < first_middle) == (next < first_middle)) continue;
      const double half =
          (mesh.nodes[static_cast<std::size_t>(corner)] - mesh.nodes[static_cast<std::size_t>(next)]).norm();
      lengths[std::max(corner, next)] = 2 * half;
    }
  }
  Shaper shaper(mesh, distance);
  for (const auto& [node, length] : lengths) {
    pulse();
    shaper.move(node, length);
  }
  return mesh;
}

}  // namespace stylet::mesh
