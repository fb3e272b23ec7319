// Locating points and crossing the surface of tetrahedral meshes.
#include "physics/tissue/tet_topology.h"

#include "physics/tissue/tissue_model.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <random>
#include <stdexcept>

namespace stylet::physics {
namespace {

Eigen::Matrix3Xd positions_of(const TetMesh& mesh) {
  Eigen::Matrix3Xd p(3, mesh.nodes.size());
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) p.col(Eigen::Index(n)) = mesh.nodes[n];
  return p;
}

TEST(TetTopology, LocatesPointsOfADeformedBody) {
  TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {4, 4, 4});
  reference::jitter_inner_nodes(mesh, 0.05, 3);
  const TetTopology topology(mesh);
  Eigen::Matrix3Xd p = positions_of(mesh);
  for (int n = 0; n < p.cols(); ++n) p(0, n) += 0.3 * p(2, n) * p(2, n);  // sheared
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-0.2, 1.5);
  int inside = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d x(any(random), any(random), any(random));
    const TetPoint walked = topology.locate(p, x, int(random() % mesh.tets.size()));
    const TetPoint searched = topology.locate(p, x, -1);
    EXPECT_EQ(walked.tet < 0, searched.tet < 0);
    const bool truly_inside = x.y() > 0 && x.y() < 1 && x.z() > 0 && x.z() < 1;
    if (!truly_inside) {
      EXPECT_LT(searched.tet, 0);
    }
    if (searched.tet < 0) continue;
    ++inside;
    EXPECT_LT((topology.position(p, walked) - x).norm(), 1e-14);
    EXPECT_NEAR(walked.barycentric.sum(), 1, 1e-14);
    EXPECT_GE(walked.barycentric.minCoeff(), -1e-9);
  }
  EXPECT_GT(inside, 500);
}

TEST(TetTopology, OnTheWayAPointIsFoundAsAmongAllTetrahedra) {
  // A comb: straight ways go in and out of it, and walks end in its notches.
  TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {10, 4, 4});
  std::erase_if(mesh.tets, [&](const auto& tet) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int n : tet) centre += 0.25 * mesh.nodes[n];
    return centre.z() > 0.5 && static_cast<int>(centre.x() * 10) % 2 == 1;
  });
  const TetTopology topology(mesh);
  const Eigen::Matrix3Xd p = positions_of(mesh);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-0.1, 1.1);
  int inside = 0, outside = 0;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d from(any(random), any(random), any(random)), to(any(random), any(random), any(random));
    TetPoint last = topology.locate(p, from, -1);
    int hint = last.tet;
    for (int k = 1; k <= 20; ++k) {
      const auto at = [&](int step) -> Eigen::Vector3d { return from + step / 20.0 * (to - from); };
      const TetPoint found = topology.follow(p, at(k - 1), last.tet >= 0, at(k), hint);
      const TetPoint searched = topology.locate(p, at(k), -1);
      ASSERT_EQ(found.tet >= 0, searched.tet >= 0) << "way " << i << ", step " << k;
      if (found.tet >= 0) {
        EXPECT_LT((topology.position(p, found) - at(k)).norm(), 1e-14);
        hint = found.tet;
      }
      ++(found.tet >= 0 ? inside : outside);
      last = found;
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(TetTopology, EveryLineThroughAConvexBodyEntersAndLeavesOnce) {
  const TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {3, 3, 3});
  const TetTopology topology(mesh);
  const Eigen::Matrix3Xd p = positions_of(mesh);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(0.05, 0.95);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d inner(any(random), any(random), any(random));
    const Eigen::Vector3d direction = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    std::vector<SurfaceCrossing> hits;
    topology.crossings(p, inner - 3 * direction, direction, 6, hits);
    ASSERT_EQ(hits.size(), 2U);
    EXPECT_TRUE(hits[0].entering);
    EXPECT_FALSE(hits[1].entering);
    for (const SurfaceCrossing& hit : hits) {
      const Eigen::Vector3d x = inner + (hit.distance - 3) * direction;
      EXPECT_LT((topology.position(p, hit.point) - x).norm(), 1e-13);
      EXPECT_NEAR(hit.normal.cwiseAbs().maxCoeff(), 1, 1e-14);  // faces of a box
      EXPECT_EQ(hit.entering, hit.normal.dot(direction) < 0);
    }
  }
}

TEST(TetTopology, LineThroughEdgesAndNodesCountsOnce) {
  const TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {2, 2, 2});
  const TetTopology topology(mesh);
  const Eigen::Matrix3Xd p = positions_of(mesh);
  for (const Eigen::Vector3d& through :
       {Eigen::Vector3d(0, 0.5, 0.5), Eigen::Vector3d(0, 0.25, 0.25), Eigen::Vector3d(0, 0.5, 0.1)}) {
    std::vector<SurfaceCrossing> hits;
    topology.crossings(p, through - Eigen::Vector3d(1, 0, 0), Eigen::Vector3d::UnitX(), 5, hits);
    ASSERT_EQ(hits.size(), 2U);
    EXPECT_NEAR(hits[0].distance, 1, 1e-14);
    EXPECT_NEAR(hits[1].distance, 2, 1e-14);
  }
}

TEST(TissueModel, RefusesMalformedBodies) {
  TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {1, 1, 1});
  const std::vector<ElasticMaterial> materials(mesh.tets.size());
  const std::vector<int> fixed{0, 1, 2, 3};
  EXPECT_NO_THROW(TissueModel(mesh, materials, fixed));
  const auto refused = [&](const TetMesh& m, const std::vector<ElasticMaterial>& e, const std::vector<int>& f) {
    EXPECT_THROW(TissueModel(m, e, f), std::invalid_argument);
  };
  refused(mesh, {}, fixed);
  refused(mesh, materials, {0, 1});
  refused(mesh, materials, {0, 2, 1});
  refused(mesh, materials, {0, 1, 8});
  refused(mesh, materials, {0, 1, 2, 3, 4, 5, 6, 7});
  refused(mesh, std::vector<ElasticMaterial>(mesh.tets.size(), {1e3, 0.5}), fixed);
  TetMesh flipped = mesh;
  std::swap(flipped.tets[2][0], flipped.tets[2][1]);
  refused(flipped, materials, fixed);
  TetMesh stray = mesh;
  stray.nodes.emplace_back(2, 2, 2);
  refused(stray, materials, fixed);
  TetMesh missing = mesh;
  missing.tets[0][0] = 99;
  refused(missing, materials, fixed);
}

}  // namespace
}  // namespace stylet::physics
