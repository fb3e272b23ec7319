#include "engine/mesh/tet_manifold.h"

#include "engine/mesh/tet_quality.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace stylet::mesh {
namespace {

class DisjointSets {
public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(b)] = find(a); }

private:
  std::vector<std::size_t> parent_;
};

double volume(const physics::TetMesh& mesh, std::size_t t) {
  const auto& v = mesh.tets[t];
  const Eigen::Vector3d& origin = mesh.nodes[v[0]];
  return (mesh.nodes[v[1]] - origin).dot((mesh.nodes[v[2]] - origin).cross(mesh.nodes[v[3]] - origin)) / 6;
}

int shared_nodes(const std::array<int, 4>& a, const std::array<int, 4>& b) {
  int shared = 0;
  for (const int node : a) shared += std::find(b.begin(), b.end(), node) != b.end() ? 1 : 0;
  return shared;
}

bool has_node(const std::array<int, 4>& tet, int node) {
  return std::find(tet.begin(), tet.end(), node) != tet.end();
}

// Of the face-connected groups that `tets` fall into, marks all but the largest; all of them if there is one group
// only and `also_single`.
void drop_smaller_groups(const physics::TetMesh& mesh, const std::vector<std::size_t>& tets, bool also_single,
                         std::vector<char>& drop) {
  DisjointSets groups(tets.size());
  for (std::size_t i = 0; i < tets.size(); ++i) {
    for (std::size_t j = i + 1; j < tets.size(); ++j) {
      if (shared_nodes(mesh.tets[tets[i]], mesh.tets[tets[j]]) == 3) groups.join(i, j);
    }
  }
  std::vector<double> size(tets.size(), 0);
  for (std::size_t i = 0; i < tets.size(); ++i) size[groups.find(i)] += volume(mesh, tets[i]);
  const std::size_t largest = static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
  const bool single = std::count_if(size.begin(), size.end(), [](double s) { return s > 0; }) == 1;
  for (std::size_t i = 0; i < tets.size(); ++i) {
    if (groups.find(i) != largest || (single && also_single)) drop[tets[i]] = 1;
  }
}

std::vector<std::vector<std::size_t>> tets_at_nodes(const physics::TetMesh& mesh) {
  std::vector<std::vector<std::size_t>> at(mesh.nodes.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (const int node : mesh.tets[t]) at[node].push_back(t);
  }
  return at;
}

void mark_smaller_parts(const physics::TetMesh& mesh, std::vector<char>& drop, const files::Pulse& pulse) {
  struct Face {
    std::array<int, 3> key;
    std::size_t tet;
  };
  std::vector<Face> faces;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    pulse();
    for (int skip = 0; skip < 4; ++skip) {
      std::array<int, 3> key{};
      for (int i = 0, k = 0; i < 4; ++i) {
        if (i != skip) key[k++] = mesh.tets[t][i];
      }
      std::sort(key.begin(), key.end());
      faces.push_back({key, t});
    }
  }
  std::sort(faces.begin(), faces.end(), [&](const Face& a, const Face& b) {
    pulse();
    return a.key != b.key ? a.key < b.key : a.tet < b.tet;
  });
  DisjointSets parts(mesh.tets.size());
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].key == faces[i - 1].key) parts.join(faces[i - 1].tet, faces[i].tet);
  }
  std::vector<double> size(mesh.tets.size(), 0);
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) size[parts.find(t)] += volume(mesh, t);
  const std::size_t largest = static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (parts.find(t) != largest) drop[t] = 1;
  }
}

void mark_pinches(const physics::TetMesh& mesh, std::vector<char>& drop, const files::Pulse& pulse) {
  const BoundarySurface boundary = boundary_surface(mesh, pulse);
  const auto at = tets_at_nodes(mesh);

  std::vector<std::array<int, 2>> edges;
  std::vector<std::vector<std::size_t>> faces_at(mesh.nodes.size());
  for (std::size_t f = 0; f < boundary.mesh.triangles.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = boundary.nodes[boundary.mesh.triangles[f][i]];
      const int b = boundary.nodes[boundary.mesh.triangles[f][(i + 1) % 3]];
      edges.push_back({std::min(a, b), std::max(a, b)});
      faces_at[a].push_back(f);
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first + 1;
    while (last < edges.size() && edges[last] == edges[first]) ++last;
    if (last - first > 2) {
      std::vector<std::size_t> around;
      for (const std::size_t t : at[edges[first][0]]) {
        if (has_node(mesh.tets[t], edges[first][1])) around.push_back(t);
      }
      drop_smaller_groups(mesh, around, false, drop);
    }
    first = last;
  }
  if (std::find(drop.begin(), drop.end(), 1) != drop.end()) return;  // vertices are judged once edges are clean

  for (const int node : boundary.nodes) {
    pulse(faces_at[node].size());
    // Umbrellas: boundary triangles at the node, joined where they share another node.
    const auto& fan = faces_at[node];
    DisjointSets umbrellas(fan.size());
    for (std::size_t i = 0; i < fan.size(); ++i) {
      for (std::size_t j = i + 1; j < fan.size(); ++j) {
        int shared = 0;
        for (const std::uint32_t v : boundary.mesh.triangles[fan[i]]) {
          const auto& other = boundary.mesh.triangles[fan[j]];
          shared += std::find(other.begin(), other.end(), v) != other.end() ? 1 : 0;
        }
        if (shared == 2) umbrellas.join(i, j);
      }
    }
    std::size_t count = 0;
    for (std::size_t i = 0; i < fan.size(); ++i) count += umbrellas.find(i) == i ? 1 : 0;
    if (count > 1) drop_smaller_groups(mesh, at[node], true, drop);
  }
}

// Takes the marked tetrahedra away; true if there was one.
bool erase_marked(physics::TetMesh& mesh, const std::vector<char>& drop) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (!drop[t]) mesh.tets[kept++] = mesh.tets[t];
  }
  const bool erased = kept < mesh.tets.size();
  mesh.tets.resize(kept);
  return erased;
}

void drop_unused_nodes(physics::TetMesh& mesh) {
  std::vector<int> compact(mesh.nodes.size(), 0);
  for (const auto& tet : mesh.tets) {
    for (const int node : tet) compact[node] = 1;
  }
  int kept = 0;
  for (std::size_t n = 0; n < compact.size(); ++n) {
    if (!compact[n]) continue;
    mesh.nodes[kept] = mesh.nodes[n];
    compact[n] = kept++;
  }
  mesh.nodes.resize(kept);
  for (auto& tet : mesh.tets) {
    for (int& node : tet) node = compact[node];
  }
}

}  // namespace

void keep_manifold_part(physics::TetMesh& mesh, Parts parts, const files::Pulse& pulse) {
  bool changed = true;
  while (changed && !mesh.tets.empty()) {  // ends: every round but the last takes tetrahedra away
    std::vector<char> drop(mesh.tets.size(), 0);
    if (parts == Parts::largest) mark_smaller_parts(mesh, drop, pulse);
    changed = erase_marked(mesh, drop);
    drop.assign(mesh.tets.size(), 0);
    mark_pinches(mesh, drop, pulse);
    changed = erase_marked(mesh, drop) || changed;
  }
  drop_unused_nodes(mesh);
}

}  // namespace stylet::mesh
