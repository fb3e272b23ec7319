#include "engine/mesh/tet_smoothing.h"

#include "engine/mesh/tet_quality.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace stylet::mesh {
namespace {

// Nodes with a better worst angle than this are left where they are.
constexpr double kGoodAngle = 28 * std::numbers::pi / 180;
constexpr std::array<double, 3> kCentroidSteps{1.0, 0.5, 0.2};
constexpr std::array<double, 3> kPatternSteps{0.12, 0.05, 0.02};  // of the cell

// Smallest sine of the six dihedral angles; negative if inverted. sin = 3 V l / (2 A1 A2).
double smallest_sine(const std::array<Eigen::Vector3d, 4>& x) {
  const double volume6 = (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0]));
  // Twice the area of the face opposite each corner.
  const std::array<double, 4> area2{(x[2] - x[1]).cross(x[3] - x[1]).norm(), (x[2] - x[0]).cross(x[3] - x[0]).norm(),
                                    (x[1] - x[0]).cross(x[3] - x[0]).norm(), (x[1] - x[0]).cross(x[2] - x[0]).norm()};
  double smallest = 1;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      int k = 0;  // the edge between faces i and j joins the two other corners
      while (k == i || k == j) ++k;
      const int l = 6 - i - j - k;
      smallest = std::min(smallest, volume6 * (x[k] - x[l]).norm() / (area2[i] * area2[j]));
    }
  }
  return smallest;
}

struct Node {
  std::vector<int> tets;
  std::vector<int> neighbours;
  bool boundary = false;
};

class Smoother {
public:
  Smoother(physics::TetMesh& mesh, const SignedDistance& distance, double cell)
      : mesh_(mesh), distance_(distance), cell_(cell), nodes_(mesh.nodes.size()) {
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
      for (const int node : mesh.tets[t]) {
        nodes_[node].tets.push_back(static_cast<int>(t));
        for (const int other : mesh.tets[t]) {
          if (other != node) nodes_[node].neighbours.push_back(other);
        }
      }
    }
    for (Node& node : nodes_) {
      std::sort(node.neighbours.begin(), node.neighbours.end());
      node.neighbours.erase(std::unique(node.neighbours.begin(), node.neighbours.end()), node.neighbours.end());
    }
    for (const int node : boundary_surface(mesh).nodes) nodes_[node].boundary = true;
  }

  // One pass; true if a node moved.
  bool pass() {
    bool moved = false;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].tets.empty()) continue;
      quality_ = quality(n, mesh_.nodes[n]);
      if (quality_ > std::sin(kGoodAngle)) continue;
      if (nodes_[n].boundary) normal_ = gradient(mesh_.nodes[n]);
      const bool centred = towards_centroid(n);
      const bool searched = pattern_search(n);
      moved = moved || centred || searched;
    }
    return moved;
  }

private:
  double quality(std::size_t n, const Eigen::Vector3d& position) const {
    double worst = std::numeric_limits<double>::infinity();
    for (const int t : nodes_[n].tets) {
      std::array<Eigen::Vector3d, 4> x;
      for (int i = 0; i < 4; ++i) {
        const int node = mesh_.tets[t][i];
        x[i] = node == static_cast<int>(n) ? position : mesh_.nodes[node];
      }
      worst = std::min(worst, smallest_sine(x));
      if (worst <= quality_ && worst < 0) break;
    }
    return worst;
  }

  Eigen::Vector3d gradient(const Eigen::Vector3d& x) const {
    const double step = 0.02 * cell_;
    Eigen::Vector3d g;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
      g[axis] = distance_(x + offset) - distance_(x - offset);
    }
    return g.stableNormalized();
  }

  // Moves node n to `position` (a boundary node: to the isosurface along the normal) if that is better.
  bool try_move(std::size_t n, Eigen::Vector3d position) {
    if (nodes_[n].boundary) {
      for (int newton = 0; newton < 3; ++newton) {
        const double error = distance_(position);
        if (!(std::abs(error) < cell_)) return false;
        position -= error * normal_;
        if (std::abs(error) < 1e-4 * cell_) break;
      }
    }
    const double better = quality(n, position);
    if (!(better > quality_ * (1 + 1e-6))) return false;
    mesh_.nodes[n] = position;
    quality_ = better;
    return true;
  }

  bool towards_centroid(std::size_t n) {
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    int count = 0;
    for (const int other : nodes_[n].neighbours) {
      if (nodes_[n].boundary && !nodes_[other].boundary) continue;
      centroid += mesh_.nodes[other];
      ++count;
    }
    if (count == 0) return false;
    const Eigen::Vector3d move = centroid / count - mesh_.nodes[n];
    for (const double step : kCentroidSteps) {
      if (try_move(n, mesh_.nodes[n] + step * move)) return true;
    }
    return false;
  }

  bool pattern_search(std::size_t n) {
    bool moved = false;
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    if (nodes_[n].boundary) {
      axes.col(0) = normal_.unitOrthogonal();
      axes.col(1) = normal_.cross(axes.col(0));
    }
    for (const double step : kPatternSteps) {
      for (int direction = 0; direction < (nodes_[n].boundary ? 4 : 6); ++direction) {
        const double sign = direction % 2 == 0 ? 1 : -1;
        moved = try_move(n, mesh_.nodes[n] + sign * step * cell_ * axes.col(direction / 2)) || moved;
      }
    }
    return moved;
  }

  physics::TetMesh& mesh_;
  const SignedDistance& distance_;
  double cell_;
  std::vector<Node> nodes_;
  double quality_ = 0;                                 // of the node being moved
  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();  // of the isosurface there
};

}  // namespace

void smooth(physics::TetMesh& mesh, const SignedDistance& distance, double cell, int passes) {
  Smoother smoother(mesh, distance, cell);
  for (int pass = 0; pass < passes; ++pass) {
    if (!smoother.pass()) return;
  }
}

}  // namespace stylet::mesh
