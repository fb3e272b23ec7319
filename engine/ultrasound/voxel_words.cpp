#include "engine/ultrasound/voxel_words.h"

#include "physics/messages/messages.h"

#include <algorithm>
#include <array>

namespace stylet::ultrasound {
namespace {

constexpr float kMeshEdge = 1.5F;    ///< voxels by which a mesh may miss the surface it was made from
constexpr float kRim = 0.008F;       ///< m by which the edges of a cut may be rounded: anatomy goes on from there
constexpr float kCutProbe = 0.020F;  ///< m deeper the cross-section is compared ...
constexpr float kFlat = 0.85F;   ///< ... and what share of that is there at a cut, at least; a round end has 0.2-0.75
constexpr double kFacing = 0.5;  ///< cosine from which on the probe looks into a face
constexpr int kOwnerShift = 8;
constexpr int kClearanceShift = 11;
constexpr int kMostClearance = 31;
static_assert(physics::kMaxBodies + 2 <= 1 << (kClearanceShift - kOwnerShift), "an owner has three bits");

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

/// Labels of `scene` with the walls that are thinner than its surfaces: one voxel each.
std::vector<std::uint16_t> walled_labels(const content::Scene& scene) {
  const content::LabelVolume& labels = scene.labels;
  std::vector<std::uint16_t> walled(labels.labels.begin(), labels.labels.end());
  const Grid grid{labels.size};
  for (const content::TissueWall& wall : scene.tissue_walls) {
    std::size_t here = 0;
    Eigen::Vector3i v;
    for (v.z() = 0; v.z() < grid.size.z(); ++v.z()) {
      for (v.y() = 0; v.y() < grid.size.y(); ++v.y()) {
        for (v.x() = 0; v.x() < grid.size.x(); ++v.x(), ++here) {
          if (labels.labels[here] != wall.inside) continue;
          for (int side = 0; side < 6; ++side) {
            Eigen::Vector3i beside = v;
            beside[side / 2] += side % 2 == 0 ? -1 : 1;
            if ((beside.array() < 0).any() || (beside.array() >= grid.size.array()).any()) continue;
            if (const std::size_t i = grid.at(beside); labels.labels[i] == wall.outside) {
              walled[i] = static_cast<std::uint16_t>(wall.wall);
            }
          }
        }
      }
    }
  }
  return walled;
}

/// Where the patient ends flat, it was cut: anatomy goes on there, as at the cut, and stays where it is. The face
/// that the probe looks into is skin, flat or not.
void extend_beyond_cuts(std::vector<std::uint16_t>& words, const content::Scene& scene) {
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
                           [&](std::size_t i, const Eigen::Vector3i&) { count += words[i] != 0 ? 1 : 0; });
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
          words[i] = static_cast<std::uint16_t>(label_of(words[grid.at(v)]));
        });
      }
    }
  }
}

/// Distance along the axes (chessboard) from every voxel to the nearest that differs, in two sweeps over its 26
/// neighbours (A. Rosenfeld, J. Pfaltz, Pattern Recognition 1, 1968). Beyond the volume it is as at its border.
void add_clearance(std::vector<std::uint16_t>& words, const Eigen::Vector3i& size) {
  const auto at = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * size.y() + y) * size.x() + static_cast<std::size_t>(x);
  };
  std::vector<std::uint8_t> distance(words.size(), kMostClearance);
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
            nearest = std::min(nearest, words[there] == words[here] ? distance[there] + 1 : 1);
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
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = static_cast<std::uint16_t>(words[i] | distance[i] << kClearanceShift);
  }
}

}  // namespace

std::vector<std::uint16_t> voxel_words(const content::Scene& scene) {
  const content::LabelVolume& labels = scene.labels;
  std::vector<std::uint16_t> words = walled_labels(scene);
  const auto own = [&](std::size_t voxel, std::size_t owner) {
    words[voxel] = static_cast<std::uint16_t>(label_of(words[voxel]) | (owner + 1) << kOwnerShift);
  };
  // A voxel belongs to the body whose tetrahedra carry it. What only hangs on a body, outside its mesh (the
  // gallbladder under the liver), stays where it is at rest; a voxel at the mesh's own rough edge does not.
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    const std::vector<std::uint8_t> covered =
        covered_voxels(labels, scene.bodies[body].mesh, kMeshEdge * labels.spacing);
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (covered[i] != 0 && labels.bodies[i] == static_cast<int>(body)) own(i, body);
    }
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (labels.bodies[i] == content::kBreathes) own(i, scene.bodies.size());
  }
  extend_beyond_cuts(words, scene);
  add_clearance(words, labels.size);
  words.resize((words.size() + 1) / 2 * 2);
  return words;
}

}  // namespace stylet::ultrasound
