#include "engine/content/embedding.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::content {
namespace {

/// Tetrahedra by the cells of a regular grid that their boxes touch.
class TetGrid {
public:
  explicit TetGrid(const physics::TetMesh& mesh) {
    for (const auto& node : mesh.nodes) box_.extend(node);
    // About one cell a tetrahedron, few enough for any mesh.
    const double cells = static_cast<double>(mesh.tets.size()) + 1;
    cell_ = std::max(std::cbrt(box_.volume() / cells), box_.sizes().maxCoeff() / 100);
    for (int a = 0; a < 3; ++a) size_[a] = static_cast<int>(box_.sizes()[a] / cell_) + 1;
    lists_.resize(size_.prod());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
      Eigen::AlignedBox3d tet;
      for (const int node : mesh.tets[t]) tet.extend(mesh.nodes[node]);
      visit(cell_of(tet.min()), cell_of(tet.max()),
            [&](std::vector<int>& list) { list.push_back(static_cast<int>(t)); });
    }
  }

  Eigen::Vector3i cell_of(const Eigen::Vector3d& point) const {
    Eigen::Vector3i cell;
    for (int a = 0; a < 3; ++a) {
      cell[a] =
          static_cast<int>(std::clamp((point[a] - box_.min()[a]) / cell_, 0.0, static_cast<double>(size_[a] - 1)));
    }
    return cell;
  }

  /// Tetrahedra of all cells at most `ring` away from `centre`.
  template <typename Visitor>
  void near(const Eigen::Vector3i& centre, int ring, Visitor&& visitor) {
    const Eigen::Vector3i first = (centre.array() - ring).max(0);
    const Eigen::Vector3i last = (centre.array() + ring).min(size_.array() - 1);
    visit(first, last, [&](const std::vector<int>& list) {
      for (const int tet : list) visitor(static_cast<std::size_t>(tet));
    });
  }

  int largest_ring() const { return size_.maxCoeff(); }

private:
  template <typename Visitor>
  void visit(const Eigen::Vector3i& first, const Eigen::Vector3i& last, Visitor&& visitor) {
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          visitor(lists_[(z * size_.y() + y) * size_.x() + x]);
        }
      }
    }
  }

  Eigen::AlignedBox3d box_;
  double cell_ = 1;
  Eigen::Vector3i size_ = Eigen::Vector3i::Ones();
  std::vector<std::vector<int>> lists_;
};

/// Columns: from the first node of a tetrahedron to the others.
Eigen::Matrix3d edges_of(const physics::TetMesh& mesh, std::size_t tet) {
  const auto node = [&](std::size_t i) -> const Eigen::Vector3d& { return mesh.nodes[mesh.tets[tet][i]]; };
  Eigen::Matrix3d edges;
  edges << node(1) - node(0), node(2) - node(0), node(3) - node(0);
  return edges;
}

}  // namespace

std::vector<Embedding> embed(std::span<const Eigen::Vector3f> points, const physics::TetMesh& mesh) {
  std::vector<Embedding> out;
  out.reserve(points.size());
  if (mesh.tets.empty()) return out;
  TetGrid grid(mesh);
  std::vector<Eigen::Matrix3d> inverses;  // of the edge matrices, once a tetrahedron
  inverses.reserve(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) inverses.push_back(edges_of(mesh, t).inverse());
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3d p = point.cast<double>();
    const Eigen::Vector3i cell = grid.cell_of(p);
    std::size_t best_tet = 0;
    Eigen::Vector4d best = Eigen::Vector4d::Zero();
    double best_excess = std::numeric_limits<double>::infinity();
    const auto consider = [&](std::size_t tet) {
      const Eigen::Vector3d v = inverses[tet] * (p - mesh.nodes[mesh.tets[tet][0]]);
      const Eigen::Vector4d w(1 - v.sum(), v[0], v[1], v[2]);
      const double excess = std::max(0.0, -w.minCoeff());  // 0 inside, grows with the extrapolation
      if (excess < best_excess) {
        best_excess = excess;
        best = w;
        best_tet = tet;
      }
    };
    grid.near(cell, 0, consider);
    if (best_excess > 1e-9) {
      // Outside: look at all tetrahedra round about, one ring wider than the first that finds any.
      int ring = 0;
      while (std::isinf(best_excess) && ring < grid.largest_ring()) grid.near(cell, ++ring, consider);
      grid.near(cell, ring + 1, consider);
    }
    Embedding embedding;
    for (std::size_t i = 0; i < 4; ++i) {
      embedding.nodes[i] = static_cast<std::uint32_t>(mesh.tets[best_tet][i]);
      embedding.weights[i] = static_cast<float>(best[static_cast<Eigen::Index>(i)]);
    }
    out.push_back(embedding);
  }
  return out;
}

float largest_weight(std::span<const Embedding> embedding) {
  float largest = 0;
  for (const Embedding& e : embedding) {
    for (const float w : e.weights) largest = std::max(largest, std::abs(w));
  }
  return largest;
}

}  // namespace stylet::content
