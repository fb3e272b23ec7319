// Points found in the present shape of a patch's tetrahedra.
#include "physics/contact/patch_walk.h"
#include "tests/support/random.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <utility>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

/// A block of 40 x 40 x 20 mm, all of it in the patch, its upper face dented as by a needle that presses on it.
std::unique_ptr<TissuePatch> dented_block(double depth, double width) {
  const TetMesh mesh = reference::kuhn_box({-0.02, -0.02, -0.02}, {0.02, 0.02, 0}, {6, 6, 3});
  auto patch = std::make_unique<TissuePatch>();
  patch->epoch = patch->body_count = 1;
  BodyPatch& body = patch->bodies[0];
  body.node_count = static_cast<int>(mesh.nodes.size());
  for (int n = 0; n < body.node_count; ++n) {
    const Vector3d& rest = mesh.nodes[n];
    body.node_ids[n] = n;
    body.rest_positions.col(n) = rest;
    const double r = rest.head<2>().norm() / width;
    body.free_positions.col(n) = rest - depth * (1 + rest.z() / 0.02) * std::exp(-r * r) * Vector3d::UnitZ();
  }
  body.tet_count = static_cast<int>(mesh.tets.size());
  std::map<std::array<int, 3>, std::pair<int, int>> open;  // face -> tetrahedron, corner opposite
  for (int t = 0; t < body.tet_count; ++t) {
    body.tet_ids[t] = t;
    body.tet_nodes[t] = mesh.tets[t];
    body.tet_neighbours[t].fill(kBeyondSurface);
    for (int k = 0; k < 4; ++k) {
      std::array<int, 3> face{mesh.tets[t][(k + 1) % 4], mesh.tets[t][(k + 2) % 4], mesh.tets[t][(k + 3) % 4]};
      std::ranges::sort(face);
      const auto other = open.find(face);
      if (other == open.end()) {
        open[face] = {t, k};
      } else {
        body.tet_neighbours[t][k] = other->second.first;
        body.tet_neighbours[other->second.first][other->second.second] = t;
      }
    }
  }
  return patch;
}

Vector3d position(const BodyPatch& body, const Eigen::Matrix3Xd& nodes, int tet, const Vector4d& barycentric) {
  Vector3d x = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) x += barycentric[k] * nodes.col(body.tet_nodes[tet][k]);
  return x;
}

// A dent hides points from each other in the present shape; at rest each is found from everywhere.
TEST(PatchWalk, AtRestFindsEveryPointOfADentedBody) {
  for (const double depth : {0.0, 0.012}) {
    const auto patch = dented_block(depth, 0.009);
    const BodyPatch& body = patch->bodies[0];
    support::Random random(5);
    const TissuePoints no_forces;
    int left = 0, left_at_rest = 0, tried = 0;
    double worst = 0;
    for (int from = 0; from < body.tet_count; from += 3) {
      for (int tet = 0; tet < body.tet_count; tet += 5) {
        Vector4d barycentric = Vector4d::NullaryExpr([&] { return 0.02 + std::abs(random.vector(1).x()); });
        barycentric /= barycentric.sum();
        const PatchWalk now =
            walk_patch(*patch, 0, from, position(body, body.free_positions, tet, barycentric), no_forces);
        const Vector3d rest = position(body, body.rest_positions, tet, barycentric);
        const PatchWalk at_rest = walk_patch_at_rest(*patch, 0, from, rest);
        ++tried;
        left += now.left != PatchWalk::Left::nothing;
        left_at_rest += at_rest.left != PatchWalk::Left::nothing;
        const Vector3d found = position(body, body.rest_positions, at_rest.patch_tet, at_rest.barycentric);
        worst = std::max(worst, (found - rest).norm());
      }
    }
    std::printf("dent of %2.0f mm: of %d walks %d left the body, at rest %d; farthest off %.1e m\n", 1e3 * depth,
                tried, left, left_at_rest, worst);
    EXPECT_EQ(left_at_rest, 0);
    EXPECT_LT(worst, 1e-12);
    EXPECT_EQ(left > 0, depth > 0);
  }
}

TEST(PatchWalk, LeavesTheBodyForPointsOutsideIt) {
  const auto patch = dented_block(0.012, 0.009);
  const TissuePoints no_forces;
  for (const Vector3d& outside :
       {Vector3d(0, 0, -0.006), Vector3d(0.001, 0.002, -0.004), Vector3d(0.025, 0, -0.01), Vector3d(0, 0, 0.03)}) {
    for (int from = 0; from < patch->bodies[0].tet_count; from += 11) {
      const PatchWalk walk = walk_patch(*patch, 0, from, outside, no_forces);
      EXPECT_EQ(walk.left, PatchWalk::Left::body) << outside.transpose() << " from " << from;
      EXPECT_GE(walk.barycentric.minCoeff(), 0);
    }
  }
}

// Among tetrahedra that are inside out a walk may come to no end; it then does not say that it has found the point.
TEST(PatchWalk, WhatItFindsIsWhereItSaysAlsoAmongTetrahedraInsideOut) {
  const TissuePoints no_forces;
  auto patch = dented_block(0.012, 0.009);
  BodyPatch& body = patch->bodies[0];
  support::Random random(8);
  for (int n = 0; n < body.node_count; n += 3) body.free_positions.col(n) += random.vector(0.005);
  int found = 0, endless = 0;
  double worst = 0;
  for (int from = 0; from < body.tet_count; ++from) {
    for (int k = 0; k < 20; ++k) {
      const Vector3d x = Vector3d(0, 0, -0.01) + random.vector(0.012);
      const PatchWalk walk = walk_patch(*patch, 0, from, x, no_forces);
      endless += walk.left == PatchWalk::Left::patch;  // all of the body is in the patch
      if (walk.left != PatchWalk::Left::nothing) continue;
      ++found;
      worst = std::max(worst, (position(body, body.free_positions, walk.patch_tet, walk.barycentric) - x).norm());
    }
  }
  std::printf("%d found, farthest off %.1e m; %d came to no end\n", found, worst, endless);
  EXPECT_GT(found, 1000);
  EXPECT_GT(endless, 0);
  EXPECT_LT(worst, 1e-9);
}

TEST(PatchWalk, InsideOutTetrahedraAreThoseThatTheForceTurns) {
  const TissuePoints no_forces;
  auto patch = dented_block(0.012, 0.009);
  BodyPatch& body = patch->bodies[0];
  for (int tet = 0; tet < body.tet_count; ++tet) EXPECT_FALSE(inside_out(*patch, 0, tet, no_forces)) << tet;
  // A node pushed through the face opposite it.
  const auto& corners = body.tet_nodes[40];
  const Vector3d face = (body.free_positions.col(corners[1]) + body.free_positions.col(corners[2]) +
                         body.free_positions.col(corners[3])) /
                        3;
  body.free_positions.col(corners[0]) += 2.5 * (face - body.free_positions.col(corners[0]));
  EXPECT_TRUE(inside_out(*patch, 0, 40, no_forces));
}

}  // namespace
}  // namespace stylet::physics
