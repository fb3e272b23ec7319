#include "engine/readers/label_volume.h"

#include "engine/content/embedding.h"
#include "engine/mesh/tetrahedralise.h"
#include "tests/gltf/glb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <random>

namespace stylet::readers {
namespace {

/// Winding number of a closed surface about a point: solid angles of its triangles over 4 pi (van Oosterom and
/// Strackee 1983). 1 inside, 0 outside. Shares nothing with the parity of rows.
double winding_number(const mesh::TriangleMesh& mesh, const Eigen::Vector3d& point) {
  double angle = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[i] - point;
    const Eigen::Vector3d b = mesh.vertices[j] - point;
    const Eigen::Vector3d c = mesh.vertices[k] - point;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

Eigen::Vector3d centre_of(const content::LabelVolume& volume, int i, int j, int k) {
  return volume.origin.cast<double>() + static_cast<double>(volume.spacing) * Eigen::Vector3d(i, j, k);
}

std::size_t index_of(const content::LabelVolume& volume, int i, int j, int k) {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(volume.size.y()) + static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(volume.size.x()) +
         static_cast<std::size_t>(i);
}

TEST(LabelVolume, AgreesWithTheWindingNumberAtRandomVoxels) {
  const mesh::TriangleMesh outer = gltf::test::sphere({0.01, -0.02, 0.03}, 0.05);
  const mesh::TriangleMesh inner = gltf::test::sphere({0.02, -0.02, 0.03}, 0.02);
  const std::vector<LabelledSolid> solids{{&outer, 7, 2}, {&inner, 9, -1}};
  const content::LabelVolume volume = voxelise(solids, 0.001, std::nullopt);
  std::mt19937 random(1);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  int inside = 0;
  for (int n = 0; n < 4000; ++n) {
    const int i = pick(volume.size.x());
    const int j = pick(volume.size.y());
    const int k = pick(volume.size.z());
    const Eigen::Vector3d p = centre_of(volume, i, j, k);
    const int expected = winding_number(inner, p) > 0.5 ? 9 : winding_number(outer, p) > 0.5 ? 7 : 0;
    ASSERT_EQ(volume.labels[index_of(volume, i, j, k)], expected) << p.transpose();
    ASSERT_EQ(volume.bodies[index_of(volume, i, j, k)], expected == 7 ? 2 : -1);
    inside += expected != 0;
  }
  EXPECT_GT(inside, 1000);
}

TEST(LabelVolume, KnowsHowFarTheSurfaceIsWhereTheTissueChanges) {
  // The second covers a part of the first's surface, the third is of the first's tissue and opens into it.
  struct Ball {
    Eigen::Vector3d centre;
    double radius;
    double distance(const Eigen::Vector3d& p) const { return std::abs((p - centre).norm() - radius); }
  };
  const std::array<Ball, 3> balls{{{{0, 0, 0}, 0.0121}, {{0.0113, 0.002, 0}, 0.0064}, {{-0.0105, 0, 0.001}, 0.0071}}};
  std::vector<mesh::TriangleMesh> surfaces;
  // Facets lie within 2 um of the ball: r (pi / rings)^2 / 8.
  for (const Ball& ball : balls) surfaces.push_back(gltf::test::sphere(ball.centre, ball.radius, 96));
  const std::vector<LabelledSolid> solids{{&surfaces[0], 7, -1}, {&surfaces[1], 9, -1}, {&surfaces[2], 7, -1}};
  EXPECT_TRUE(voxelise(solids, 0.001, std::nullopt).edges.empty());
  const content::LabelVolume volume = voxelise(solids, 0.001, std::nullopt, LabelEdges::measured);
  ASSERT_EQ(volume.edges.size(), volume.labels.size());
  constexpr std::array<std::array<int, 3>, 6> kSides{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  int checked = 0;
  for (int k = 1; k + 1 < volume.size.z(); ++k) {
    for (int j = 1; j + 1 < volume.size.y(); ++j) {
      for (int i = 1; i + 1 < volume.size.x(); ++i) {
        const std::size_t here = index_of(volume, i, j, k);
        const bool changes = std::ranges::any_of(kSides, [&](const std::array<int, 3>& d) {
          return volume.labels[index_of(volume, i + d[0], j + d[1], k + d[2])] != volume.labels[here];
        });
        if (!changes) continue;
        const Eigen::Vector3d p = centre_of(volume, i, j, k);
        std::array<double, 3> all{};
        std::ranges::transform(balls, all.begin(), [&](const Ball& ball) { return ball.distance(p); });
        std::ranges::sort(all);
        if (all[1] < 3e-3) continue;  // where surfaces meet, which of them is left is another matter
        ++checked;
        // Half of kEdgeStep is 5 um.
        EXPECT_NEAR(double(content::kEdgeStep) * volume.edges[here] * 1e-3, all[0], 0.01e-3) << p.transpose();
      }
    }
  }
  EXPECT_GT(checked, 1000);
  // The first's surface is not where the third goes on in the same tissue, nor within the second.
  const auto at = [&](double x, double y, double z) {
    const Eigen::Vector3d v = (Eigen::Vector3d(x, y, z) - volume.origin.cast<double>()) / 1e-3;
    return index_of(volume, int(std::lround(v.x())), int(std::lround(v.y())), int(std::lround(v.z())));
  };
  EXPECT_EQ(volume.edges[at(-0.0121, 0, 0)], content::kNoEdge);
  EXPECT_EQ(volume.edges[at(0.0118, 0.002, 0)], content::kNoEdge);
}

TEST(LabelVolume, VolumeConvergesToTheSolid) {
  const mesh::TriangleMesh ball = gltf::test::sphere({0, 0, 0}, 0.03, 64);
  const std::vector<LabelledSolid> solids{{&ball, 1, -1}};
  double expected = 0;
  for (const auto& [a, b, c] : ball.triangles) {
    expected += ball.vertices[a].dot(ball.vertices[b].cross(ball.vertices[c])) / 6;
  }
  const content::LabelVolume volume = voxelise(solids, 0.001, std::nullopt);
  const auto count = static_cast<double>(std::count(volume.labels.begin(), volume.labels.end(), 1));
  // Counting voxels errs by about the square root of those at the surface (11 300): well below 1 %.
  EXPECT_NEAR(count * 1e-9 / expected, 1, 0.01);
}

TEST(LabelVolume, RowsThroughVerticesAndEdgesKeepParity) {
  // A box whose corners, edges and diagonals lie on voxel centres.
  mesh::TriangleMesh box;
  for (int n = 0; n < 8; ++n) box.vertices.push_back(0.01 * Eigen::Vector3d(n & 1, n >> 1 & 1, n >> 2 & 1));
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const std::vector<LabelledSolid> solids{{&box, 1, -1}};
  const content::LabelVolume volume = voxelise(solids, 0.001, std::nullopt);
  const auto crossings = row_crossings(box, volume);
  ASSERT_EQ(crossings.size() % 2, 0u);
  for (std::size_t c = 0; c < crossings.size(); c += 2) EXPECT_EQ(crossings[c].row, crossings[c + 1].row);
  EXPECT_EQ(volume.labels[index_of(volume, 6, 6, 6)], 1);
  EXPECT_EQ(volume.labels[index_of(volume, 13, 6, 6)], 0);
}

TEST(LabelVolume, FillerLiesBehindTheWallOnly) {
  const mesh::TriangleMesh wall = gltf::test::sphere({0, 0, 0.05}, 0.01);
  const mesh::TriangleMesh organ = gltf::test::sphere({0, 0, 0}, 0.01);
  const std::vector<LabelledSolid> solids{{&wall, 1, 0}, {&organ, 2, 1}};
  const content::LabelVolume volume =
      voxelise(solids, 0.001, LabelFiller{.label = 5, .wall = {0}, .axis = 2, .positive = true});
  const auto at = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3i v = ((p - volume.origin.cast<double>()) / volume.spacing).array().round().cast<int>();
    return static_cast<int>(volume.labels[index_of(volume, v.x(), v.y(), v.z())]);
  };
  EXPECT_EQ(at({0, 0, 0.05}), 1);
  EXPECT_EQ(at({0, 0, 0.025}), 5) << "between";
  EXPECT_EQ(at({0, 0, 0}), 2);
  EXPECT_EQ(at({0, 0, -0.0105}), 5) << "behind both";
  EXPECT_EQ(at({0, 0, 0.0605}), 0) << "in front of the wall";
  EXPECT_EQ(at({0.0095, 0.0095, 0}), 0) << "beside the wall";
}

TEST(LabelVolume, StaysWithinItsMemory) {
  const mesh::TriangleMesh ball = gltf::test::sphere({0, 0, 0}, 1.0);
  const std::vector<LabelledSolid> solids{{&ball, 1, -1}};
  const content::LabelVolume volume = voxelise(solids, 0.001, std::nullopt);
  EXPECT_LE(volume.labels.size() + volume.bodies.size(), kLabelBytes);
  EXPECT_GT(volume.spacing, 0.001F);
}

TEST(Embedding, ReproducesRestVerticesInsideAndOut) {
  const mesh::TriangleMesh ball = gltf::test::sphere({0.1, 0.2, 0.3}, 0.05, 24);
  const physics::TetMesh mesh = mesh::tetrahedralise(ball, {.cell = 0.02, .where = "ball"});
  std::vector<Eigen::Vector3f> points;
  for (const auto& vertex : ball.vertices) points.push_back(vertex.cast<float>());
  for (const auto& vertex : gltf::test::sphere({0.1, 0.2, 0.3}, 0.03).vertices)
    points.push_back(vertex.cast<float>());
  const auto embedding = content::embed(points, mesh);
  ASSERT_EQ(embedding.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      sum += static_cast<double>(embedding[i].weights[n]) * mesh.nodes[embedding[i].nodes[n]];
      weight += static_cast<double>(embedding[i].weights[n]);
    }
    EXPECT_LT((sum - points[i].cast<double>()).norm(), 1e-6);
    EXPECT_NEAR(weight, 1, 1e-6);
  }
  // Faces of a 20 mm lattice cut the ball's surface by a few millimetres at most: little extrapolation.
  EXPECT_LT(content::largest_weight(embedding), 2);
}

TEST(Embedding, AffineMotionCarriesEveryVertexExactly) {
  const mesh::TriangleMesh ball = gltf::test::sphere({0, 0, 0}, 0.05, 12);
  physics::TetMesh mesh = mesh::tetrahedralise(ball, {.cell = 0.02, .where = "ball"});
  std::vector<Eigen::Vector3f> points;
  for (const auto& vertex : ball.vertices) points.push_back(vertex.cast<float>());
  const auto embedding = content::embed(points, mesh);
  Eigen::Affine3d motion = Eigen::Affine3d::Identity();
  motion.linear() << 1.1, 0.2, 0, -0.1, 0.9, 0.05, 0, 0.3, 1;
  motion.translation() << 0.01, 0.02, -0.03;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t n = 0; n < 4; ++n) {
      sum += static_cast<double>(embedding[i].weights[n]) * (motion * mesh.nodes[embedding[i].nodes[n]]);
    }
    EXPECT_LT((sum - motion * points[i].cast<double>()).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace stylet::readers
