#include "engine/ultrasound/voxel_words.h"

#include "physics/messages/messages.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::ultrasound {
namespace {

constexpr float kMeshEdge = 1.5F;    ///< voxels by which a mesh may miss the surface it was made from
constexpr float kRim = 0.008F;       ///< m by which the edges of a cut may be rounded: anatomy goes on from there
constexpr float kCutProbe = 0.020F;  ///< m deeper the cross-section is compared ...
constexpr float kFlat = 0.85F;   ///< ... and what share of that is there at a cut, at least; a round end has 0.2-0.75
constexpr double kFacing = 0.5;  ///< cosine from which on the probe looks into a face
constexpr int kOwnerShift = 8;
constexpr int kEdgeShift = 11;
constexpr int kMostClearance = 31 + 2 - kEdges;
// Distances in content::kEdgeStep:
constexpr int kWall = 100;        ///< that a wall is thick: a voxel
constexpr int kEdgeUnknown = 50;  ///< from a voxel's centre to its border
static_assert(physics::kMaxBodies + 2 <= 1 << (kEdgeShift - kOwnerShift), "an owner has three bits");

/// Voxels of `labels` inside the rest mesh of a body, or within `margin` (m) outside it. [voxels] 1 or 0
std::vector<std::uint8_t> covered_voxels(const content::LabelVolume& labels, const physics::TetMesh& mesh,
                                         float margin) {
  std::vector<std::uint8_t> covered(labels.labels.size(), 0);
  for (const std::array<int, 4>& tet : mesh.tets) {
    Eigen::Matrix<float, 3, 4> p;
    for (int i = 0; i < 4; ++i) p.col(i) = (mesh.nodes[tet[i]].cast<float>() - labels.origin) / labels.spacing;
    const Eigen::Matrix3f edges = p.rightCols<3>().colwise() - p.col(0);
    if (!(std::abs(edges.determinant()) > 1e-6F)) continue;
    const Eigen::Matrix3f inverse = edges.inverse();
    Eigen::Matrix<float, 4, 3> gradient;
    gradient << -inverse.colwise().sum(), inverse;
    const Eigen::Vector4f slack = gradient.rowwise().norm() * (margin / labels.spacing);
    const float reach = margin / labels.spacing;
    const Eigen::Array3i low = (p.rowwise().minCoeff().array() - reach).ceil().cast<int>().max(0);
    const Eigen::Array3i high =
        (p.rowwise().maxCoeff().array() + reach).floor().cast<int>().min(labels.size.array() - 1);
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        const std::size_t row = (static_cast<std::size_t>(k) * labels.size.y() + j) * labels.size.x();
        for (int i = low.x(); i <= high.x(); ++i) {
          Eigen::Vector4f w = gradient * (Eigen::Vector3f(float(i), float(j), float(k)) - p.col(0));
          w[0] += 1;
          if ((w.array() >= -slack.array()).all()) covered[row + i] = 1;
        }
      }
    }
  }
  return covered;
}

/// Index of a voxel, and what lies on either side of it.
struct Grid {
  Eigen::Vector3i size;

  std::size_t at(const Eigen::Vector3i& v) const {
    return (static_cast<std::size_t>(v.z()) * size.y() + v.y()) * size.x() + static_cast<std::size_t>(v.x());
  }
  Eigen::Vector3i voxel(std::size_t index) const {
    const int row = static_cast<int>(index / size.x());
    return {static_cast<int>(index % size.x()), row % size.y(), row / size.y()};
  }
  /// Calls visit(index, voxel) for all voxels.
  template <typename Visit>
  void each(Visit&& visit) const {
    for (int z = 0; z < size.z(); ++z) each_of_layer(2, z, visit);
  }
  /// Calls visit(index, axes along which it lies beside) for the voxels around one.
  template <typename Visit>
  void each_beside(const Eigen::Vector3i& v, Visit&& visit) const {
    const Eigen::Vector3i low = (v.array() - 1).max(0), high = (v.array() + 2).min(size.array());
    Eigen::Vector3i n;
    for (n.z() = low.z(); n.z() < high.z(); ++n.z()) {
      for (n.y() = low.y(); n.y() < high.y(); ++n.y()) {
        for (n.x() = low.x(); n.x() < high.x(); ++n.x()) {
          if (const int axes = static_cast<int>((n.array() != v.array()).count()); axes > 0) visit(at(n), axes);
        }
      }
    }
  }
  /// Calls visit(index, voxel) for the voxels of a layer across an axis.
  template <typename Visit>
  void each_of_layer(int axis, int layer, Visit&& visit) const {
    Eigen::Vector3i v;
    v[axis] = layer;
    for (v[(axis + 1) % 3] = 0; v[(axis + 1) % 3] < size[(axis + 1) % 3]; ++v[(axis + 1) % 3]) {
      for (v[(axis + 2) % 3] = 0; v[(axis + 2) % 3] < size[(axis + 2) % 3]; ++v[(axis + 2) % 3]) visit(at(v), v);
    }
  }
};

/// A voxel of the anatomy while its word is made.
struct Voxel {
  std::uint16_t word = 0;            ///< label | (owner + 1) << kOwnerShift
  std::uint8_t edge = kEdgeUnknown;  ///< as content::LabelVolume has it
};

std::vector<Voxel> voxels_of(const content::LabelVolume& labels) {
  std::vector<Voxel> voxels(labels.labels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i].word = labels.labels[i];
  for (std::size_t i = 0; i < labels.edges.size(); ++i) voxels[i].edge = labels.edges[i];
  return voxels;
}

/// Puts the walls in that are thinner than the surfaces of `scene`: one voxel each, on the surface's outside.
void add_walls(std::vector<Voxel>& voxels, const content::Scene& scene) {
  const content::LabelVolume& labels = scene.labels;
  const Grid grid{labels.size};
  std::vector<std::size_t> in_wall;
  for (const content::TissueWall& wall : scene.tissue_walls) {
    in_wall.clear();
    grid.each([&](std::size_t here, const Eigen::Vector3i& v) {
      if (labels.labels[here] != wall.inside) return;
      grid.each_beside(v, [&](std::size_t there, int axes) {
        if (voxels[there].word != wall.outside) return;
        if (axes > 1 && (labels.edges.empty() || voxels[there].edge >= kWall)) return;
        voxels[there].word = static_cast<std::uint16_t>(wall.wall);
        in_wall.push_back(there);
      });
    });
    // The wall's own outside is as far beyond the surface as the wall is thick.
    if (labels.edges.empty()) continue;
    std::vector<std::size_t> beyond;
    for (const std::size_t i : in_wall) {
      grid.each_beside(grid.voxel(i), [&](std::size_t there, int) {
        if (voxels[there].word == wall.outside) beyond.push_back(there);
      });
      const int edge = voxels[i].edge;
      voxels[i].edge = static_cast<std::uint8_t>(std::min(edge, std::max(kWall - edge, 0)));
    }
    std::ranges::sort(beyond);
    beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
    for (const std::size_t i : beyond)
      voxels[i].edge = static_cast<std::uint8_t>(std::max(voxels[i].edge - kWall, 0));
  }
}

/// Where the patient ends flat, it was cut: anatomy goes on there, as at the cut, and stays where it is. The face
/// that the probe looks into is skin, flat or not.
void extend_beyond_cuts(std::vector<Voxel>& voxels, const content::Scene& scene) {
  const Grid grid{scene.labels.size};
  const Eigen::Vector3d axis_of_probe = scene.probe.pose.orientation * Eigen::Vector3d::UnitZ();
  const int rim = static_cast<int>(kRim / scene.labels.spacing + 0.5F);
  const int deeper = static_cast<int>(kCutProbe / scene.labels.spacing + 0.5F);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int inward : {1, -1}) {
      if (inward * axis_of_probe[axis] > kFacing) continue;
      const int border = inward > 0 ? 0 : grid.size[axis] - 1;
      const auto tissue_in = [&](int layer) {
        int count = 0;
        grid.each_of_layer(axis, layer,
                           [&](std::size_t i, const Eigen::Vector3i&) { count += voxels[i].word != 0 ? 1 : 0; });
        return count;
      };
      int first = border;
      while (first >= 0 && first < grid.size[axis] && tissue_in(first) == 0) first += inward;
      first += inward * rim;
      const int inner = first + inward * deeper;
      if (inner < 0 || inner >= grid.size[axis] ||
          static_cast<float>(tissue_in(first)) < kFlat * static_cast<float>(tissue_in(inner))) {
        continue;
      }
      for (int layer = border; layer != first; layer += inward) {
        grid.each_of_layer(axis, layer, [&](std::size_t i, Eigen::Vector3i v) {
          v[axis] = first;
          voxels[i] = voxels[grid.at(v)];
          voxels[i].word = static_cast<std::uint16_t>(label_of(voxels[i].word));
        });
      }
    }
  }
}

/// Distance along the axes (chessboard) from every voxel to the nearest that differs, in two sweeps over its 26
/// neighbours (A. Rosenfeld, J. Pfaltz, Pattern Recognition 1, 1968). Beyond the volume it is as at its border.
std::vector<std::uint8_t> clearances(const std::vector<Voxel>& voxels, const Eigen::Vector3i& size) {
  const auto at = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * size.y() + y) * size.x() + static_cast<std::size_t>(x);
  };
  std::vector<std::uint8_t> distance(voxels.size(), kMostClearance);
  const auto sweep = [&](bool forward) {
    const int step = forward ? -1 : 1;
    for (int i = 0; i < size.z(); ++i) {
      const int z = forward ? i : size.z() - 1 - i;
      for (int j = 0; j < size.y(); ++j) {
        const int y = forward ? j : size.y() - 1 - j;
        for (int k = 0; k < size.x(); ++k) {
          const int x = forward ? k : size.x() - 1 - k;
          const std::size_t here = at(x, y, z);
          int nearest = distance[here];
          // The thirteen neighbours that this sweep has visited before: a plane, a row, one voxel.
          const auto look = [&](int nx, int ny, int nz) {
            const std::size_t there =
                at(std::clamp(nx, 0, size.x() - 1), std::clamp(ny, 0, size.y() - 1), std::clamp(nz, 0, size.z() - 1));
            nearest = std::min(nearest, voxels[there].word == voxels[here].word ? distance[there] + 1 : 1);
          };
          for (int dy = -1; dy <= 1; ++dy) {
            for (int dx = -1; dx <= 1; ++dx) look(x + dx, y + dy, z + step);
          }
          for (int dx = -1; dx <= 1; ++dx) look(x + dx, y + step, z);
          look(x + step, y, z);
          distance[here] = static_cast<std::uint8_t>(nearest);
        }
      }
    }
  };
  sweep(true);
  sweep(false);
  return distance;
}

}  // namespace

std::vector<std::uint16_t> voxel_words(const content::Scene& scene) {
  const content::LabelVolume& labels = scene.labels;
  std::vector<Voxel> voxels = voxels_of(labels);
  add_walls(voxels, scene);
  const auto own = [&](std::size_t i, std::size_t owner) {
    voxels[i].word = static_cast<std::uint16_t>(label_of(voxels[i].word) | (owner + 1) << kOwnerShift);
  };
  // A voxel belongs to the body whose tetrahedra carry it. What only hangs on a body, outside its mesh (the
  // gallbladder under the liver), stays where it is at rest; a voxel at the mesh's own rough edge does not.
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    const std::vector<std::uint8_t> covered =
        covered_voxels(labels, scene.bodies[body].mesh, kMeshEdge * labels.spacing);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      if (covered[i] != 0 && labels.bodies[i] == static_cast<int>(body)) own(i, body);
    }
  }
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (labels.bodies[i] == content::kBreathes) own(i, scene.bodies.size());
  }
  extend_beyond_cuts(voxels, scene);
  const std::vector<std::uint8_t> clearance = clearances(voxels, labels.size);
  std::vector<std::uint16_t> words((voxels.size() + 1) / 2 * 2);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const int edge = static_cast<int>(std::lround(voxels[i].edge * content::kEdgeStep * kEdgesPerVoxel)) - 1;
    const int code = clearance[i] > 1 ? clearance[i] + kEdges - 2 : std::clamp(edge, 0, kEdges - 1);
    words[i] = static_cast<std::uint16_t>(voxels[i].word | code << kEdgeShift);
  }
  return words;
}

}  // namespace stylet::ultrasound
