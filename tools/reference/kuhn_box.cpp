#include "tools/reference/kuhn_box.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <random>
#include <utility>

namespace stylet::reference {

physics::TetMesh kuhn_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const std::array<int, 3>& cells) {
  physics::TetMesh mesh;
  const auto [nx, ny, nz] = cells;
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        const Eigen::Vector3d fraction(double(i) / nx, double(j) / ny, double(k) / nz);
        mesh.nodes.emplace_back(low + fraction.cwiseProduct(high - low));
      }
    }
  }
  const std::array<int, 3> stride{1, nx + 1, (nx + 1) * (ny + 1)};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const int corner = i * stride[0] + j * stride[1] + k * stride[2];
        std::array<int, 3> axes{0, 1, 2};
        do {  // the six ways from the low corner to the high one along the edges
          std::array<int, 4> tet{corner, 0, 0, 0};
          for (std::size_t a = 0; a < 3; ++a) tet[a + 1] = tet[a] + stride[axes[a]];
          const auto edge = [&](std::size_t a) -> Eigen::Vector3d { return mesh.nodes[tet[a]] - mesh.nodes[tet[0]]; };
          if (edge(1).dot(edge(2).cross(edge(3))) < 0) std::swap(tet[2], tet[3]);
          mesh.tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  return mesh;
}

std::vector<int> nodes_where(const physics::TetMesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& where) {
  std::vector<int> nodes;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (where(mesh.nodes[n])) nodes.push_back(static_cast<int>(n));
  }
  return nodes;
}

void jitter_inner_nodes(physics::TetMesh& mesh, double amount, unsigned seed) {
  Eigen::Vector3d low = mesh.nodes.front();
  Eigen::Vector3d high = low;
  for (const auto& x : mesh.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-amount, amount);
  for (auto& x : mesh.nodes) {
    const Eigen::Vector3d by(shift(random), shift(random), shift(random));
    if ((x.array() > low.array() + 1e-9).all() && (x.array() < high.array() - 1e-9).all()) x += by;
  }
}

}  // namespace stylet::reference
