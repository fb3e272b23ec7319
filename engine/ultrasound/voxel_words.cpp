#include "engine/ultrasound/voxel_words.h"

#include "physics/loops/messages.h"

#include <algorithm>
#include <array>

namespace stylet::ultrasound {
namespace {

constexpr float kMeshEdge = 1.5F;  ///< voxels by which a mesh may miss the surface it was made from
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

/// Distance along the axes (chessboard) from every voxel to the nearest that differs, in two sweeps over its 26
/// neighbours (A. Rosenfeld, J. Pfaltz, Pattern Recognition 1, 1968). Outside the volume all words are 0.
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
            const bool outside = nx < 0 || ny < 0 || nz < 0 || nx >= size.x() || ny >= size.y() || nz >= size.z();
            const std::size_t there = outside ? 0 : at(nx, ny, nz);
            const bool same = (outside ? 0 : words[there]) == words[here];
            nearest = std::min(nearest, !same ? 1 : outside ? kMostClearance : distance[there] + 1);
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
  std::vector<std::uint16_t> words(labels.labels.begin(), labels.labels.end());
  const auto own = [&](std::size_t voxel, std::size_t owner) {
    words[voxel] = static_cast<std::uint16_t>(labels.labels[voxel] | (owner + 1) << kOwnerShift);
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
  add_clearance(words, labels.size);
  words.resize((words.size() + 1) / 2 * 2);
  return words;
}

}  // namespace stylet::ultrasound
