#include "physics/tissue/refinement.h"

#include <Eigen/LU>

#include <algorithm>
#include <map>

namespace stylet::physics {
namespace {

/// Edges without a common node: the inner diagonals join their middles.
constexpr std::array<std::pair<int, int>, 3> kOpposite{{{0, 5}, {1, 4}, {2, 3}}};

void add_oriented(TetMesh& mesh, std::array<int, 4> tet) {
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = mesh.nodes[tet[a + 1]] - mesh.nodes[tet[0]];
  if (edges.determinant() < 0) std::swap(tet[2], tet[3]);
  mesh.tets.push_back(tet);
}

}  // namespace

TetMesh refined(const TetMesh& coarse) {
  TetMesh fine{.nodes = coarse.nodes, .tets = {}};
  fine.tets.reserve(kTetsOfRefined * coarse.tets.size());
  std::map<std::pair<int, int>, int> middles;
  for (const auto& tet : coarse.tets) {
    std::array<int, 6> middle{};
    for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
      const auto [a, b] = std::minmax(tet[kTetEdges[e].first], tet[kTetEdges[e].second]);
      const auto [entry, fresh] = middles.try_emplace({a, b}, static_cast<int>(fine.nodes.size()));
      if (fresh) fine.nodes.push_back(0.5 * (coarse.nodes[a] + coarse.nodes[b]));
      middle[e] = entry->second;
    }
    for (int i = 0; i < 4; ++i) {
      std::array<int, 4> corner{};
      corner[i] = tet[i];
      for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
        if (kTetEdges[e].first == i) corner[kTetEdges[e].second] = middle[e];
        if (kTetEdges[e].second == i) corner[kTetEdges[e].first] = middle[e];
      }
      fine.tets.push_back(corner);
    }
    std::array<double, 3> lengths{};
    for (std::size_t d = 0; d < kOpposite.size(); ++d) {
      lengths[d] = (fine.nodes[middle[kOpposite[d].first]] - fine.nodes[middle[kOpposite[d].second]]).norm();
    }
    const auto shortest =
        static_cast<std::size_t>(std::min_element(lengths.begin(), lengths.end()) - lengths.begin());
    const auto [from, to] = kOpposite[shortest];
    const auto [c, c_opposite] = kOpposite[(shortest + 1) % 3];
    const auto [d, d_opposite] = kOpposite[(shortest + 2) % 3];
    const std::array<int, 4> ring{c, d, c_opposite, d_opposite};
    for (std::size_t i = 0; i < ring.size(); ++i) {
      add_oriented(fine, {middle[from], middle[to], middle[ring[i]], middle[ring[(i + 1) % 4]]});
    }
  }
  return fine;
}

}  // namespace stylet::physics
